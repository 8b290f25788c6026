/* The few registers of an STM32F405 that the examples use. BOARD: replace by your HAL. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* The internal oscillator, on after reset; no clock is set up. */
#define CORE_HZ 16000000u

/* Text on USART2 (PA2), 115200 baud. */
void board_text_start(void);
void board_text(const char *text);
/* Eight hexadecimal digits: the bits of a word or of a float. */
void board_hex(uint32_t word);
uint32_t board_bits(float value);
/* A number with so many digits behind the point, in a column of this width. */
void board_number(float value, unsigned width, unsigned digits);

/* TIM3 calls TIM3_IRQHandler at this rate. */
void board_ticker_start(uint32_t rate_hz);
void board_ticker_acknowledge(void);
/* EXTI0_IRQHandler runs as soon as TIM3_IRQHandler does not: neither interrupts the other. */
void board_pend_longer(void);
/* PendSV_Handler runs as soon as no interrupt does. */
void board_pend(void);
void board_sleep(void);
/* The end: of the emulator too, if EMULATED is defined. */
void board_end(void);

#endif
