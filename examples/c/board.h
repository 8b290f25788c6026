/* Access to the few STM32F405 registers that the examples use. BOARD: replace by your HAL. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* Frequency of the internal oscillator, Hz. It runs after reset; the examples set up no clock. */
#define CORE_HZ 16000000u

/* Sends text on USART2 (PA2), 115200 baud. */
void board_text_start(void);
void board_text(const char *text);
/* Sends the bits of a word or of a float as eight hexadecimal digits. */
void board_hex(uint32_t word);
uint32_t board_bits(float value);
/* Sends a number with this many decimals, in a column of this width. */
void board_number(float value, unsigned width, unsigned digits);

/* Starts TIM3, which calls TIM3_IRQHandler at this rate. */
void board_ticker_start(uint32_t rate_hz);
void board_ticker_acknowledge(void);
/* Requests EXTI0_IRQHandler, which runs when TIM3_IRQHandler does not: neither interrupts the other. */
void board_pend_longer(void);
/* Requests PendSV_Handler, which runs when no interrupt does. */
void board_pend(void);
void board_sleep(void);
/* Ends the program; with EMULATED defined it also ends the emulator. */
void board_end(void);

#endif
