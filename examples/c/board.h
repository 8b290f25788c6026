/* Access to the few STM32F405 registers that the examples use. BOARD: replace by your HAL. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

/* Clocks of TIM3 and USART2, Hz. After reset the internal oscillator drives both; the examples set up no clock.
 * BOARD: after a set-up of 168 MHz with the usual bus divider of 4, TIMER_HZ is 84000000u and SERIAL_HZ 42000000u. */
#ifndef CORE_HZ
#define CORE_HZ 16000000u
#endif
#ifndef TIMER_HZ
#if CORE_HZ > 16000000u && !defined(EMULATED)
#error "give TIMER_HZ with CORE_HZ: behind a bus divider the timer has another clock"
#endif
#define TIMER_HZ CORE_HZ
#endif
#ifndef SERIAL_HZ
#define SERIAL_HZ CORE_HZ
#endif

/* Sends text on USART2 (PA2), 115200 baud. */
void board_text_start(void);
void board_text(const char *text);
/* Sends the bits of a word or of a float as eight hexadecimal digits. */
void board_hex(uint32_t word);
uint32_t board_bits(float value);
/* Sends a number with this many decimals, in a column of this width. */
void board_number(float value, unsigned width, unsigned digits);
/* Sends a line of a table: time, planned and true angle, their difference, current. */
void board_row(float time_s, float planned_rad, float angle_rad, float ampere);

/* Starts TIM3, which calls TIM3_IRQHandler at this rate. */
void board_ticker_start(uint32_t rate_hz);
void board_ticker_acknowledge(void);
/* Returns whether the next period has begun. */
bool board_ticker_is_due(void);
/* Requests EXTI0_IRQHandler, which runs when TIM3_IRQHandler does not: neither interrupts the other. */
void board_pend_longer(void);
/* Requests PendSV_Handler, which runs when no interrupt does. */
void board_pend(void);
void board_sleep(void);
/* Ends the program; with EMULATED defined it also ends the emulator. */
void board_end(void);
/* Prints the reason and stops, with interrupts off; with EMULATED defined it ends the emulator with status 1. BOARD:
 * switch the power stage off first. */
void board_stop(const char *reason);

#endif
