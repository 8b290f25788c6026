/* Start-up code before main: initial values of variables, and the FPU. Replace it by your vendor's start-up file. */
#include "board.h"

extern uint32_t stack_top, data_image, data_start, data_end, bss_start, bss_end;

int main(void);
void Reset_Handler(void);
void Default_Handler(void);
void PendSV_Handler(void) __attribute__((weak, alias("Default_Handler")));
void EXTI0_IRQHandler(void) __attribute__((weak, alias("Default_Handler")));
void TIM3_IRQHandler(void) __attribute__((weak, alias("Default_Handler")));

void Default_Handler(void) {
    for (;;) {
    }
}

void Reset_Handler(void) {
    uint32_t *from = &data_image;
    for (uint32_t *to = &data_start; to < &data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &bss_start; to < &bss_end;) {
        *to++ = 0;
    }
    /* CPACR: enables the FPU before its first use. */
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    main();
    Default_Handler();
}

typedef void (*handler_t)(void);

#define THREE(handler) handler, handler, handler
#define TEN(handler) THREE(handler), THREE(handler), THREE(handler), handler

/* Vector table: top of the stack, 15 exceptions (PendSV is the last but one), interrupts 0 to 29. TIM3 is the last one
 * in use. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    handler_t handlers[15 + 30];
} vectors = {&stack_top,
             {Reset_Handler, TEN(Default_Handler), Default_Handler, Default_Handler, PendSV_Handler, Default_Handler,
              THREE(Default_Handler), THREE(Default_Handler), EXTI0_IRQHandler, THREE(Default_Handler),
              TEN(Default_Handler), THREE(Default_Handler), THREE(Default_Handler), THREE(Default_Handler),
              TIM3_IRQHandler}};
