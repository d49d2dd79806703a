#include "app/parameter_store.h"

#include "link/bytes.h"
#include "link/crc.h"

#define ERASED         0xFFFFu
#define CRC_SIZE       4u
/* Words programmed in one step: some 0.3 ms. */
#define WORDS_PER_STEP 32u
#define NO_RECORD      0xFFFFFFFFu

enum { IDLE, PLACE, ERASE, PROGRAM };

void parameter_store_init(parameter_store_t *store, const store_flash_t *flash)
{
    store->flash = flash;
    store->record_used = 0;
    store->at = 0;
    store->address = 0;
    store->generation = 0;
    store->state = IDLE;
    store->copy = 0;
    store->order[0] = 0;
    store->order[1] = 1;
    store->whole[0] = store->whole[1] = 0;
    store->failures = 0;
}

static uint16_t read_word(const parameter_store_t *store, uint32_t address)
{
    return store->flash->read(store->flash->context, address);
}

static uint16_t key_of(const parameter_t *parameter)
{
    uint16_t length = 0;

    while (parameter->name[length] != '\0')
        length++;
    return crc16_ccitt(CRC16_INIT, (const uint8_t *)parameter->name, length);
}

static uint32_t record_crc(const uint8_t *record, uint16_t length)
{
    return (uint32_t)crc32_final(crc32_update(CRC32_INIT, record, length));
}

/* ---- Reading ---- */

/* Copies the record at `address` to store->record. Returns its generation, 0 if it is not whole. */
static uint32_t read_record(parameter_store_t *store, uint32_t address)
{
    uint8_t *record = store->record;
    uint16_t length = STORE_HEADER_SIZE;
    uint16_t count;
    uint16_t i;

    for (i = 0; i < STORE_HEADER_SIZE; i += 2u)
        be_put16(&record[i], read_word(store, address + i));
    count = be_get16(&record[6]);
    if (be_get32(record) != STORE_MAGIC || be_get16(&record[4]) != STORE_VERSION ||
        count > STORE_ENTRIES_MAX)
        return 0;
    length = (uint16_t)(length + count * STORE_ENTRY_SIZE);
    for (; i < length + CRC_SIZE; i += 2u)
        be_put16(&record[i], read_word(store, address + i));
    if (record_crc(record, length) != be_get32(&record[length]))
        return 0;
    return be_get32(&record[8]);
}

/* Address of the last whole record of a sector, and its generation; NO_RECORD and 0 if none. */
static uint32_t last_record(parameter_store_t *store, unsigned copy, uint32_t *generation)
{
    uint32_t start = store->flash->sector[copy];
    uint32_t found = NO_RECORD;
    uint32_t at;

    *generation = 0;
    for (at = start; at + STORE_RECORD_SIZE <= start + store->flash->size;
         at += STORE_RECORD_SIZE) {
        uint32_t here = read_record(store, at);

        if (here <= *generation)
            continue;
        *generation = here;
        found = at;
    }
    return found;
}

static int is_erased(const parameter_store_t *store, uint32_t address)
{
    uint32_t i;

    for (i = 0; i < STORE_RECORD_SIZE; i += 2u)
        if (read_word(store, address + i) != ERASED)
            return 0;
    return 1;
}

static int take_entry(const uint8_t *entry, parameters_t *parameters)
{
    uint16_t key = be_get16(entry);
    uint16_t i;

    for (i = 0; i < parameter_count(); i++)
        if (key_of(parameter_at(i)) == key)
            return parameter_set(parameters, i, (int32_t)be_get32(&entry[2]));
    return 0;
}

int32_t parameter_store_load(parameter_store_t *store, parameters_t *parameters)
{
    uint32_t generation[STORE_COPIES];
    uint32_t address[STORE_COPIES];
    unsigned newest;
    uint16_t count;
    int32_t taken = 0;
    uint16_t i;

    for (i = 0; i < STORE_COPIES; i++)
        address[i] = last_record(store, i, &generation[i]);
    newest = generation[1] > generation[0];
    store->generation = generation[newest];
    /* What is written first is the copy that would be missed least. */
    store->order[0] = (uint8_t)!newest;
    store->order[1] = (uint8_t)newest;
    if (address[newest] == NO_RECORD)
        return -1;
    (void)read_record(store, address[newest]);
    count = be_get16(&store->record[6]);
    for (i = 0; i < count; i++)
        taken += take_entry(&store->record[STORE_HEADER_SIZE + i * STORE_ENTRY_SIZE], parameters);
    return taken;
}

/* ---- Writing ---- */

static void build_record(parameter_store_t *store, const parameters_t *parameters)
{
    uint8_t *record = store->record;
    uint16_t used = STORE_HEADER_SIZE;
    uint16_t count = 0;
    uint16_t i;

    for (i = 0; i < parameter_count() && count < STORE_ENTRIES_MAX; i++) {
        int32_t value = parameter_get(parameters, i);

        if (value == parameter_at(i)->initial)
            continue;
        be_put16(&record[used], key_of(parameter_at(i)));
        be_put32(&record[used + 2u], (uint32_t)value);
        used = (uint16_t)(used + STORE_ENTRY_SIZE);
        count++;
    }
    be_put32(record, STORE_MAGIC);
    be_put16(&record[4], STORE_VERSION);
    be_put16(&record[6], count);
    be_put32(&record[8], store->generation);
    be_put32(&record[used], record_crc(record, used));
    store->record_used = (uint16_t)(used + CRC_SIZE);
}

int parameter_store_save(parameter_store_t *store, const parameters_t *parameters)
{
    uint32_t generation[STORE_COPIES];
    unsigned i;

    if (store->state != IDLE)
        return 0;
    /* Looked up anew: another save may have failed half-way. */
    for (i = 0; i < STORE_COPIES; i++)
        store->whole[i] = last_record(store, i, &generation[i]) != NO_RECORD;
    i = generation[1] > generation[0];
    store->order[0] = (uint8_t)!i;
    store->order[1] = (uint8_t)i;
    store->generation = generation[i] + 1u;
    build_record(store, parameters);
    store->copy = 0;
    store->failures = 0;
    store->state = PLACE;
    return 1;
}

static void next_copy(parameter_store_t *store, int failed)
{
    if (failed)
        store->failures++;
    store->copy++;
    store->state = PLACE;
}

static void begin_program(parameter_store_t *store, uint32_t address)
{
    store->address = address;
    store->at = 0;
    store->state = PROGRAM;
}

static uint32_t free_place(const parameter_store_t *store, unsigned copy)
{
    uint32_t start = store->flash->sector[copy];
    uint32_t at;

    for (at = start; at + STORE_RECORD_SIZE <= start + store->flash->size; at += STORE_RECORD_SIZE)
        if (is_erased(store, at))
            return at;
    return NO_RECORD;
}

/* Find room in the sector, or make some. A sector without a whole record may be half erased, and is
 * erased again. */
static void place(parameter_store_t *store)
{
    unsigned copy = store->order[store->copy];
    uint32_t at = store->whole[copy] ? free_place(store, copy) : NO_RECORD;

    if (at != NO_RECORD) {
        begin_program(store, at);
        return;
    }
    /* Never erase the old record before the new one is written in the other sector. */
    if (store->failures > 0 ||
        !store->flash->erase_begin(store->flash->context, store->flash->sector[copy])) {
        next_copy(store, 1);
        return;
    }
    store->state = ERASE;
}

static void wait_for_erase(parameter_store_t *store)
{
    uint32_t sector = store->flash->sector[store->order[store->copy]];
    int done = store->flash->erase_poll(store->flash->context, sector);

    if (done < 0)
        next_copy(store, 1);
    else if (done > 0)
        begin_program(store, sector);
}

static int is_written(const parameter_store_t *store)
{
    uint16_t i;

    for (i = 0; i < store->record_used; i += 2u)
        if (read_word(store, store->address + i) != be_get16(&store->record[i]))
            return 0;
    return 1;
}

static void program_some(parameter_store_t *store)
{
    const store_flash_t *flash = store->flash;
    unsigned words;

    for (words = 0; words < WORDS_PER_STEP && store->at < store->record_used; words++) {
        if (!flash->program(flash->context, store->address + store->at,
                            be_get16(&store->record[store->at]))) {
            next_copy(store, 1);
            return;
        }
        store->at = (uint16_t)(store->at + 2u);
    }
    if (store->at == store->record_used)
        next_copy(store, !is_written(store));
}

store_result_t parameter_store_step(parameter_store_t *store)
{
    if (store->state == IDLE)
        return STORE_IDLE;
    if (store->copy == STORE_COPIES) {
        store->state = IDLE;
        return store->failures == 0 ? STORE_DONE : STORE_FAILED;
    }
    switch (store->state) {
    case PLACE:
        place(store);
        break;
    case ERASE:
        wait_for_erase(store);
        break;
    default:
        program_some(store);
        break;
    }
    return STORE_BUSY;
}
