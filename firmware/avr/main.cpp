// The ATmega328P port (Arduino Uno or Nano, 16 MHz): pins, timers, converter, serial line, watchdog.
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "board.h"
#include "hal.h"

namespace {

const uint32_t BAUD = 250000;
// 16 conversions of each thermistor, spread evenly over a step of 20 ms: one mains period of 50 Hz
// averages to zero and one of 60 Hz to a sixth. Each half of 50 ticks has 8 groups of 6 and 2 to spare; the first ticks
// of a group start a conversion each.
const uint8_t TICKS = 100, HALF = TICKS / 2, GROUP = 6, CONVERSIONS = 16 * plate::PLACES;
static_assert(TICKS / 5 == plate::STEP_MS, "a tick is 0.2 ms");
const uint8_t CONVERTER = _BV(ADEN) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);  // 104 us each
const uint8_t HEAT_PIN = _BV(PB1), COOL_PIN = _BV(PB2), ENABLE_PIN = _BV(PB0);  // port B
const uint8_t LIGHT_PIN = _BV(PB5);    // the LED marked L on an Uno or Nano
const uint8_t CUT_OUT_PIN = _BV(PD7);  // port D, low while the cut-out is open
const uint8_t PERMIT_PIN = _BV(PD6);   // its relay holds while this is high

plate::PersistentState persistent_state __attribute__((section(".noinit")));
uint8_t reset_cause __attribute__((section(".noinit")));
void* const PARAMETERS_AT = (void*)4;  // in the EEPROM; a brown-out may damage the cell at 0

volatile uint32_t uptime_ms;
volatile uint16_t sums[plate::PLACES], due_sums[plate::PLACES];  // sums of the current step, of the last step
volatile uint8_t converted;                                      // conversions of the current step
volatile bool step_is_due;

// Powers of two, so that an index wraps by a mask.
const uint8_t RX_ROOM = 128, TX_ROOM = 128;
volatile uint8_t rx_bytes[RX_ROOM], rx_head, rx_tail;
volatile uint8_t tx_bytes[TX_ROOM], tx_head, tx_tail;

void start_conversion() {
    const uint8_t place = converted % plate::PLACES;
    ADMUX = _BV(REFS0) | place;
    ADCSRA = CONVERTER | _BV(ADSC);
}

// Writes all bits of each register at every step, which corrects bits flipped by a disturbance within 20 ms.
// Both pins stay outputs; without their COM bits they follow the zeros in PORTB instead of pulsing once a period.
void write_bridge(uint8_t enable, uint8_t com) {
    PORTB = enable | (PORTB & LIGHT_PIN);
    DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;
    TCCR1A = com | _BV(WGM11);        // mode 6: fast PWM, 9 bits
    TCCR1B = _BV(WGM12) | _BV(CS10);  // 31.25 kHz
}

void disconnect_bridge() {
    write_bridge(0, 0);
    OCR1A = OCR1B = 0;
}

void begin_sums() {
    converted = 0;
    for (uint8_t place = 0; place < plate::PLACES; place++) sums[place] = 0;
}

// Called at every step: a single flipped bit of OCR0A could double every lease, dose and window.
void set_clock() {
    TCCR0A = _BV(WGM01);  // 5 kHz
    OCR0A = F_CPU / 64 / 5000 - 1;
    TIMSK0 = _BV(OCIE0A);
    TCCR0B = _BV(CS01) | _BV(CS00);
}

// ADMUX and ADCSRA are written completely at each conversion.
void set_converter() {
    DIDR0 = _BV(ADC0D) | _BV(ADC1D) | _BV(ADC2D) | _BV(ADC3D);
    ADCSRB = 0;
}

// Writes the baud rate only if it is wrong, because writing restarts the prescaler and would damage a byte in transit.
void refresh_serial() {
    const uint8_t status = UCSR0A & _BV(U2X0);
    if (!status) UCSR0A = _BV(U2X0);
    if (UBRR0 != F_CPU / 8 / BAUD - 1) UBRR0 = F_CPU / 8 / BAUD - 1;
    if (UCSR0C != (_BV(UCSZ01) | _BV(UCSZ00))) UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B |= _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

void start_serial() {
    UCSR0A = _BV(U2X0);
    UBRR0 = F_CPU / 8 / BAUD - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

bool take_sums(uint16_t* taken) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (!step_is_due) return false;
        step_is_due = false;
        for (uint8_t place = 0; place < plate::PLACES; place++) taken[place] = due_sums[place];
    }
    return true;
}

void receive_waiting(plate::Board& board) {
    for (uint8_t most = RX_ROOM; most && rx_tail != rx_head; most--) {
        const uint8_t byte = rx_bytes[rx_tail];
        rx_tail = (rx_tail + 1) % RX_ROOM;
        receive(board, byte);
    }
}

void sleep_until_interrupt() {
    cli();
    if (rx_tail == rx_head && !step_is_due) {
        sleep_enable();
        sei();  // takes effect after the next instruction, so no interrupt can occur in between
        sleep_cpu();
        sleep_disable();
    }
    sei();
}

}  // namespace

// Runs before main and before RAM is initialised: saves the reset cause and stops the watchdog, which survives its own reset.
extern "C" void save_reset_cause() __attribute__((naked, used, section(".init3")));
extern "C" void save_reset_cause() {
    reset_cause = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

ISR(TIMER0_COMPA_vect) {
    static uint8_t tick, fifths;
    if (++fifths == 5) {
        fifths = 0;
        uptime_ms++;
    }
    if (tick == 0) begin_sums();
    const uint8_t in_half = tick % HALF;
    if (in_half < HALF / GROUP * GROUP && in_half % GROUP < plate::PLACES) start_conversion();
    if (++tick == TICKS) tick = 0;
}

ISR(ADC_vect) {
    sums[converted % plate::PLACES] += ADC;
    if (++converted < CONVERSIONS) return;
    for (uint8_t place = 0; place < plate::PLACES; place++) due_sums[place] = sums[place];
    step_is_due = true;
}

ISR(USART_RX_vect) {
    const uint8_t byte = UDR0, next = (rx_head + 1) % RX_ROOM;
    if (next == rx_tail) return;
    rx_bytes[rx_head] = byte;
    rx_head = next;
}

ISR(USART_UDRE_vect) {
    if (tx_head == tx_tail) {
        UCSR0B &= ~_BV(UDRIE0);
        return;
    }
    UDR0 = tx_bytes[tx_tail];
    tx_tail = (tx_tail + 1) % TX_ROOM;
}

namespace plate {

uint32_t hal_uptime_ms() {
    uint32_t now = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        now = uptime_ms;
    }
    return now;
}

uint8_t hal_reset_cause() {
    return reset_cause & (_BV(PORF) | _BV(EXTRF) | _BV(BORF) | _BV(WDRF));
}

void hal_drive(int16_t counts) {
    if (counts == 0) {
        disconnect_bridge();
        return;
    }
    if (counts > 0)
        OCR1A = counts - 1;
    else
        OCR1B = -counts - 1;
    write_bridge(ENABLE_PIN, counts > 0 ? _BV(COM1A1) : _BV(COM1B1));
}

void hal_light(bool on) {
    if (on)
        PORTB |= LIGHT_PIN;
    else
        PORTB &= ~LIGHT_PIN;
}

void hal_send(const uint8_t* bytes, uint8_t count) {
    // The cast precedes the remainder, because the difference is an int and a negative int has a negative remainder.
    const uint8_t room = (uint8_t)(tx_tail - tx_head - 1) % TX_ROOM;
    if (count > room) return;
    while (count--) {
        tx_bytes[tx_head] = *bytes++;
        tx_head = (tx_head + 1) % TX_ROOM;
    }
    UCSR0B |= _BV(UDRIE0);
}

// The break contact of the force-guided relay grounds the pin. It cannot close while the switching contact is
// welded, and a broken wire leaves the pin high, so neither can pass for a cut-out that opened.
bool hal_cut_out_is_open() {
    return !(PIND & CUT_OUT_PIN);
}

void hal_permit_cut_out(bool permitted) {
    PORTD = CUT_OUT_PIN | (permitted ? PERMIT_PIN : 0);  // the first is a pull-up
    DDRD = PERMIT_PIN;
}

PersistentState& hal_persistent_state() {
    return persistent_state;
}

void hal_read_parameters(uint8_t* bytes) {
    eeprom_read_block(bytes, PARAMETERS_AT, PARAMETER_BYTES);
}

void hal_write_parameters(const uint8_t* bytes) {
    eeprom_update_block(bytes, PARAMETERS_AT, PARAMETER_BYTES);
}

void hal_feed_watchdog() {
    wdt_reset();
}

}  // namespace plate

int main() {
    static plate::Board board;
    wdt_enable(WDTO_120MS);
    disconnect_bridge();
    start(board);
    set_clock();
    set_converter();
    start_serial();
    set_sleep_mode(SLEEP_MODE_IDLE);
    sei();
    for (;;) {
        uint16_t taken[plate::PLACES];
        receive_waiting(board);
        if (take_sums(taken)) {
            step(board, taken);
            set_clock();
            set_converter();
            refresh_serial();
        }
        sleep_until_interrupt();
    }
}
