#include "board.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define RCC_AHB1ENR REGISTER(0x40023830u)
#define RCC_APB1ENR REGISTER(0x40023840u)
#define GPIOA_MODER REGISTER(0x40020000u)
#define GPIOA_AFRL REGISTER(0x40020020u)
#define USART2_SR REGISTER(0x40004400u)
#define USART2_DR REGISTER(0x40004404u)
#define USART2_BRR REGISTER(0x40004408u)
#define USART2_CR1 REGISTER(0x4000440Cu)
#define TIM3_CR1 REGISTER(0x40000400u)
#define TIM3_DIER REGISTER(0x4000040Cu)
#define TIM3_SR REGISTER(0x40000410u)
#define TIM3_PSC REGISTER(0x40000428u)
#define TIM3_ARR REGISTER(0x4000042Cu)
#define NVIC_ISER0 REGISTER(0xE000E100u)
#define NVIC_ISPR0 REGISTER(0xE000E200u)
#define SCB_ICSR REGISTER(0xE000ED04u)

void board_text_start(void) {
    RCC_AHB1ENR |= 1u;                                     /* port A */
    RCC_APB1ENR |= 1u << 17;                               /* USART2 */
    GPIOA_AFRL = (GPIOA_AFRL & ~(0xFu << 8)) | 7u << 8;    /* PA2: alternate function 7 */
    GPIOA_MODER = (GPIOA_MODER & ~(3u << 4)) | 2u << 4;
    USART2_BRR = (SERIAL_HZ + 57600u) / 115200u;
    USART2_CR1 = 1u << 13 | 1u << 3;
}

void board_text(const char *text) {
    for (; *text != 0; text++) {
        while ((USART2_SR & 1u << 7) == 0) {
        }
        USART2_DR = (uint8_t)*text;
    }
}

void board_hex(uint32_t word) {
    char digits[9];
    for (int i = 7; i >= 0; i--, word >>= 4) {
        digits[i] = "0123456789abcdef"[word & 15u];
    }
    digits[8] = 0;
    board_text(digits);
}

void board_number(float value, unsigned width, unsigned digits) {
    char text[24];
    uint32_t scale = 1u;
    unsigned at = sizeof text - 1u;
    for (unsigned i = 0; i < digits; i++) {
        scale *= 10u;
    }
    const float size = (value < 0.0f) ? -value : value;
    uint32_t rest = (size < 4e9f / (float)scale) ? (uint32_t)(size * (float)scale + 0.5f) : 4000000000u;
    const int negative = value < 0.0f && rest > 0u;
    text[at] = 0;
    for (unsigned i = 0; i <= digits || rest > 0u; i++, rest /= 10u) {
        if (i > 0u && i == digits) {
            text[--at] = '.';
        }
        text[--at] = (char)('0' + rest % 10u);
    }
    if (negative) {
        text[--at] = '-';
    }
    while (sizeof text - 1u - at < width && at > 0u) {
        text[--at] = ' ';
    }
    board_text(&text[at]);
}

void board_row(float time_s, float planned_rad, float angle_rad, float ampere) {
    board_number(time_s, 8, 1);
    board_number(planned_rad, 12, 6);
    board_number(angle_rad, 12, 6);
    board_number(angle_rad - planned_rad, 12, 6);
    board_number(ampere, 10, 3);
    board_text("\n");
}

uint32_t board_bits(float value) {
    const union {
        float number;
        uint32_t word;
    } bits = {value};
    return bits.word;
}

void board_ticker_start(uint32_t rate_hz) {
    RCC_APB1ENR |= 1u << 1;
    const uint32_t clocks = TIMER_HZ / rate_hz;
    TIM3_PSC = clocks >> 16; /* the counter has 16 bits */
    TIM3_ARR = clocks / ((clocks >> 16) + 1u) - 1u;
    TIM3_DIER = 1u;
    TIM3_CR1 = 1u;
    NVIC_ISER0 = 1u << 29 | 1u << 6; /* TIM3, and EXTI0, which only board_pend_longer triggers */
}

void board_ticker_acknowledge(void) { TIM3_SR = ~1u; }

bool board_ticker_is_due(void) { return (TIM3_SR & 1u) != 0u; }

void board_pend_longer(void) { NVIC_ISPR0 = 1u << 6; }

void board_pend(void) { SCB_ICSR = 1u << 28; }

void board_sleep(void) { __asm__ volatile("wfi" ::: "memory"); }

static void end(uint32_t status) {
#ifdef EMULATED
    /* Semihosting call: end of the application with this status. */
    const uint32_t how[2] = {0x20026u, status};
    register uint32_t what __asm__("r0") = 0x20u;
    register const uint32_t *with __asm__("r1") = how;
    __asm__ volatile("bkpt 0xab" : "+r"(what) : "r"(with) : "memory");
#endif
    (void)status;
    for (;;) {
        board_sleep();
    }
}

void board_end(void) { end(0u); }

void board_stop(const char *reason) {
    __asm__ volatile("cpsid i" ::: "memory");
    board_text("stopped: ");
    board_text(reason);
    board_text("\n");
    end(1u);
}
