// sources: khepera-firmware/app/parameter_store.c khepera-firmware/app/parameters.c
// sources: khepera-firmware/app/format.c khepera-firmware/soccer/tuning.c
// includes: khepera-firmware
/* Parameters and their flash, with the supply cut at every operation. */
#include "app/parameter_store.h"

#include <setjmp.h>
#include <string.h>
#include <unity.h>

#include "link/crc.h"

#define SECTOR_SIZE 8192u
#define SECTOR_A    0x4000u
#define SECTOR_B    0x6000u

static uint16_t words[2][SECTOR_SIZE / 2];
static long operations; /* programs and erases so far */
static long cut_at;     /* the supply fails during this one; -1 never */
static unsigned fail_program;
static jmp_buf power_cut;
static uint32_t random_state;
static int erase_polls;

static parameter_store_t store;
static parameters_t parameters;

static uint32_t random_bits(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return random_state >> 8;
}

static uint16_t *word_at(uint32_t address)
{
    TEST_ASSERT_TRUE(address >= SECTOR_A && address < SECTOR_B + SECTOR_SIZE && address % 2 == 0);
    return address < SECTOR_B ? &words[0][(address - SECTOR_A) / 2]
                              : &words[1][(address - SECTOR_B) / 2];
}

static uint16_t flash_read(void *context, uint32_t address)
{
    (void)context;
    TEST_ASSERT_EQUAL_MESSAGE(0, erase_polls, "read during an erase");
    return *word_at(address);
}

static int flash_program(void *context, uint32_t address, uint16_t word)
{
    uint16_t *at = word_at(address);

    (void)context;
    if (operations++ == cut_at) {
        /* Some of the bits have made it. */
        *at = (uint16_t)(*at & (word | random_bits()));
        longjmp(power_cut, 1);
    }
    if (fail_program > 0 && --fail_program == 0)
        return 0;
    *at &= word;
    return *at == word;
}

static int flash_erase_begin(void *context, uint32_t sector)
{
    unsigned i;

    (void)context;
    if (operations++ == cut_at) {
        for (i = 0; i < SECTOR_SIZE / 2; i++)
            word_at(sector)[i] |= (uint16_t)random_bits();
        longjmp(power_cut, 1);
    }
    memset(word_at(sector), 0xFF, SECTOR_SIZE);
    erase_polls = 3;
    return 1;
}

static int flash_erase_poll(void *context, uint32_t sector)
{
    (void)context;
    (void)sector;
    return --erase_polls == 0;
}

static const store_flash_t flash = {
    NULL,          {SECTOR_A, SECTOR_B}, SECTOR_SIZE,     flash_read,
    flash_program, flash_erase_begin,    flash_erase_poll};

void setUp(void)
{
    memset(words, 0xFF, sizeof words);
    operations = 0;
    cut_at = -1;
    fail_program = 0;
    erase_polls = 0;
    random_state = 1;
    parameter_store_init(&store, &flash);
    parameters_default(&parameters);
}

void tearDown(void) {}

static store_result_t save(void)
{
    store_result_t result;
    int steps = 0;

    TEST_ASSERT_TRUE(parameter_store_save(&store, &parameters));
    do {
        result = parameter_store_step(&store);
        TEST_ASSERT_LESS_THAN_INT(1000, ++steps);
    } while (result == STORE_BUSY);
    return result;
}

/* Switch off and on again. */
static int32_t reboot(void)
{
    erase_polls = 0;
    parameter_store_init(&store, &flash);
    parameters_default(&parameters);
    return parameter_store_load(&store, &parameters);
}

static void set(const char *name, int32_t value)
{
    TEST_ASSERT_TRUE_MESSAGE(parameter_set(&parameters, parameter_find(name), value), name);
}

static int32_t get(const char *name)
{
    return parameter_get(&parameters, parameter_find(name));
}

/* ---- The table ---- */

static void every_parameter_has_a_sound_entry_and_a_key_of_its_own(void)
{
    uint16_t i;
    uint16_t j;

    TEST_ASSERT_LESS_OR_EQUAL_UINT16(STORE_ENTRIES_MAX, parameter_count());
    for (i = 0; i < parameter_count(); i++) {
        const parameter_t *parameter = parameter_at(i);
        const char *name = parameter->name;

        TEST_ASSERT_EQUAL_UINT16_MESSAGE(i, parameter_find(name), name);
        TEST_ASSERT_TRUE_MESSAGE(parameter->min < parameter->max, name);
        TEST_ASSERT_TRUE_MESSAGE(parameter->size == 2 || parameter->size == 4, name);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(parameter->initial, parameter_get(&parameters, i), name);
        TEST_ASSERT_TRUE_MESSAGE(parameter_set(&parameters, i, parameter->min) ||
                                     parameter->initial >= parameter->min,
                                 name);
        TEST_ASSERT_FALSE_MESSAGE(parameter_set(&parameters, i, parameter->max + 1), name);
        TEST_ASSERT_FALSE_MESSAGE(parameter_set(&parameters, i, parameter->min - 1), name);
        if (parameter->size == 2)
            TEST_ASSERT_TRUE_MESSAGE(parameter->min >= INT16_MIN && parameter->max <= INT16_MAX,
                                     name);
        for (j = 0; j < i; j++)
            TEST_ASSERT_NOT_EQUAL_MESSAGE(
                crc16_ccitt(CRC16_INIT, (const uint8_t *)name, (uint16_t)strlen(name)),
                crc16_ccitt(CRC16_INIT, (const uint8_t *)parameter_at(j)->name,
                            (uint16_t)strlen(parameter_at(j)->name)),
                name);
    }
    TEST_ASSERT_EQUAL_UINT16(PARAMETER_NONE, parameter_find("speed"));
}

static void the_defaults_are_k_teams(void)
{
    TEST_ASSERT_EQUAL_INT32(3800, parameters.motion.wheel.speed.p);
    TEST_ASSERT_EQUAL_INT32(800, parameters.motion.wheel.speed.i);
    TEST_ASSERT_EQUAL_INT32(100, parameters.motion.wheel.speed.d);
    TEST_ASSERT_EQUAL_INT32(3000, parameters.motion.wheel.position.p);
    TEST_ASSERT_EQUAL_INT32(20, parameters.motion.wheel.position.i);
    TEST_ASSERT_EQUAL_INT32(4000, parameters.motion.wheel.position.d);
    TEST_ASSERT_EQUAL_INT32(20, parameters.motion.profile_speed[0]);
    TEST_ASSERT_EQUAL_INT32(64, parameters.motion.profile_acceleration[1]);
    TEST_ASSERT_EQUAL_INT32(9600, parameters.serial_baud);
    TEST_ASSERT_EQUAL_MEMORY(&soccer_tuning_default, &parameters.soccer, sizeof parameters.soccer);
}

static void an_impossible_baud_rate_is_refused(void)
{
    TEST_ASSERT_FALSE(parameter_set(&parameters, parameter_find("serial.baud"), 10000));
    TEST_ASSERT_TRUE(parameter_set(&parameters, parameter_find("serial.baud"), 38400));
}

/* ---- The store ---- */

static void an_erased_flash_gives_the_defaults(void)
{
    TEST_ASSERT_EQUAL_INT32(-1, reboot());
    TEST_ASSERT_EQUAL_INT32(3800, get("speed.kp"));
}

static void what_is_saved_comes_back(void)
{
    set("speed.kp", 12);
    set("soccer.push_mm_s", 333);
    TEST_ASSERT_EQUAL(STORE_DONE, save());
    TEST_ASSERT_EQUAL_INT32(2, reboot());
    TEST_ASSERT_EQUAL_INT32(12, get("speed.kp"));
    TEST_ASSERT_EQUAL_INT32(333, get("soccer.push_mm_s"));
    TEST_ASSERT_EQUAL_INT32(800, get("speed.ki"));
}

static void both_sectors_hold_a_copy(void)
{
    unsigned copy;

    for (copy = 0; copy < 2; copy++) {
        setUp();
        set("speed.kp", 77);
        TEST_ASSERT_EQUAL(STORE_DONE, save());
        memset(words[copy], 0, SECTOR_SIZE);
        TEST_ASSERT_EQUAL_INT32(1, reboot());
        TEST_ASSERT_EQUAL_INT32(77, get("speed.kp"));
    }
}

static void defaults_can_be_saved_over_others(void)
{
    set("speed.kp", 77);
    (void)save();
    parameters_default(&parameters);
    TEST_ASSERT_EQUAL(STORE_DONE, save());
    TEST_ASSERT_EQUAL_INT32(0, reboot());
    TEST_ASSERT_EQUAL_INT32(3800, get("speed.kp"));
}

static void a_hundred_saves_go_round_the_sectors(void)
{
    int32_t i;

    for (i = 0; i < 100; i++) {
        set("speed.kp", i);
        TEST_ASSERT_EQUAL(STORE_DONE, save());
        if (i % 7 == 0) {
            (void)reboot();
            TEST_ASSERT_EQUAL_INT32(i, get("speed.kp"));
        }
    }
}

static void any_flipped_bit_leaves_the_other_copy(void)
{
    uint16_t bit;

    set("speed.kp", 4711);
    TEST_ASSERT_EQUAL(STORE_DONE, save());
    for (bit = 0; bit < 8 * (STORE_HEADER_SIZE + STORE_ENTRY_SIZE + 4); bit++) {
        words[0][bit / 16] ^= (uint16_t)(1u << bit % 16);
        TEST_ASSERT_EQUAL_INT32(1, reboot());
        TEST_ASSERT_EQUAL_INT32(4711, get("speed.kp"));
        words[0][bit / 16] ^= (uint16_t)(1u << bit % 16);
    }
}

/* Save 20, cut the supply at every operation of saving 21: 20 or 21 must be there, a further save
 * must work, and its value must be there. `saves` before decide how full the sectors are. */
static void check_every_cut(int32_t saves)
{
    volatile long cut;

    for (cut = 0;; cut++) {
        volatile int done = 0;
        int32_t i;
        int32_t found;

        setUp();
        random_state = (uint32_t)cut;
        for (i = 0; i < saves; i++) {
            set("speed.kp", i);
            TEST_ASSERT_EQUAL(STORE_DONE, save());
        }
        set("speed.kp", 20);
        TEST_ASSERT_EQUAL(STORE_DONE, save());
        set("speed.kp", 21);
        cut_at = operations + cut;
        if (setjmp(power_cut) == 0) {
            TEST_ASSERT_EQUAL(STORE_DONE, save());
            done = 1;
        }
        cut_at = -1;
        TEST_ASSERT_EQUAL_INT32(1, reboot());
        found = get("speed.kp");
        TEST_ASSERT_TRUE(found == 21 || (!done && found == 20));
        set("speed.kp", 22);
        TEST_ASSERT_EQUAL(STORE_DONE, save());
        (void)reboot();
        TEST_ASSERT_EQUAL_INT32(22, get("speed.kp"));
        if (done)
            break;
    }
    TEST_ASSERT_GREATER_THAN_INT32(20, (int32_t)cut);
}

static void a_cut_at_any_operation_loses_nothing(void)
{
    int32_t saves;

    for (saves = 0; saves < 18; saves++)
        check_every_cut(saves);
}

static void a_cut_of_the_first_save_ever_leaves_the_defaults_or_it(void)
{
    volatile long cut;

    for (cut = 0; cut < 30; cut++) {
        setUp();
        set("speed.kp", 5);
        cut_at = cut;
        if (setjmp(power_cut) == 0)
            (void)save();
        cut_at = -1;
        (void)reboot();
        TEST_ASSERT_TRUE(get("speed.kp") == 5 || get("speed.kp") == 3800);
        set("speed.kp", 6);
        TEST_ASSERT_EQUAL(STORE_DONE, save());
        (void)reboot();
        TEST_ASSERT_EQUAL_INT32(6, get("speed.kp"));
    }
}

static void a_flash_that_fails_is_told_and_loses_nothing(void)
{
    unsigned n;

    for (n = 1; n < 22; n++) {
        setUp();
        set("speed.kp", 5);
        TEST_ASSERT_EQUAL(STORE_DONE, save());
        set("speed.kp", 6);
        fail_program = n;
        TEST_ASSERT_EQUAL(STORE_FAILED, save());
        (void)reboot();
        TEST_ASSERT_TRUE(get("speed.kp") == 5 || get("speed.kp") == 6);
    }
}

static void one_save_at_a_time(void)
{
    TEST_ASSERT_TRUE(parameter_store_save(&store, &parameters));
    TEST_ASSERT_FALSE(parameter_store_save(&store, &parameters));
}

static void every_value_at_its_limit_fits_a_record(void)
{
    uint16_t i;

    for (i = 0; i < parameter_count(); i++)
        (void)parameter_set(&parameters, i, parameter_at(i)->max);
    TEST_ASSERT_EQUAL(STORE_DONE, save());
    TEST_ASSERT_GREATER_THAN_INT32(parameter_count() - 5, reboot());
    for (i = 0; i < parameter_count(); i++)
        TEST_ASSERT_EQUAL_INT32(parameter_at(i)->max, parameter_get(&parameters, i));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_parameter_has_a_sound_entry_and_a_key_of_its_own);
    RUN_TEST(the_defaults_are_k_teams);
    RUN_TEST(an_impossible_baud_rate_is_refused);
    RUN_TEST(an_erased_flash_gives_the_defaults);
    RUN_TEST(what_is_saved_comes_back);
    RUN_TEST(both_sectors_hold_a_copy);
    RUN_TEST(defaults_can_be_saved_over_others);
    RUN_TEST(a_hundred_saves_go_round_the_sectors);
    RUN_TEST(any_flipped_bit_leaves_the_other_copy);
    RUN_TEST(a_cut_at_any_operation_loses_nothing);
    RUN_TEST(a_cut_of_the_first_save_ever_leaves_the_defaults_or_it);
    RUN_TEST(a_flash_that_fails_is_told_and_loses_nothing);
    RUN_TEST(one_save_at_a_time);
    RUN_TEST(every_value_at_its_limit_fits_a_record);
    return UNITY_END();
}
