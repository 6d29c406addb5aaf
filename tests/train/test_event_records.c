/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_event_records.c -- TensorBoard records to the byte; what is kept of a damaged file. */
#include "base/memory.h"
#include "test_support.h"
#include "train/event_records.h"

/* Length of each record of `r`, by its own frames. */
static size_t list_records(const event_records *r, size_t begins[16])
{
    size_t count = 0, at = 0;
    while (at < r->count && count < 16) {
        uint64_t length;
        memcpy(&length, r->bytes + at, sizeof length);
        begins[count++] = at;
        at += 16 + (size_t)length;
    }
    assert_int_equal(at, r->count);
    return count;
}

static void frame_is_known(void **state)
{
    (void)state;
    event_records r = {0};
    event_add_version(&r);
    /* Length 26: a double behind its key, step 0, the text of 13 bytes. CRC-32C of the eight bytes, rotated
       and masked, from the definition. */
    const unsigned char length[8] = {26};
    uint32_t crc = UINT32_MAX;
    for (int i = 0; i < 8; i++) {
        crc ^= length[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0x82f63b78u : crc >> 1;
    }
    crc = ~crc;
    crc = (uint32_t)((((uint64_t)crc << 32 | crc) >> 15) & UINT32_MAX) + 0xa282ead8u;
    assert_int_equal(r.count, 8 + 4 + 26 + 4);
    assert_memory_equal(r.bytes, length, 8);
    assert_memory_equal(r.bytes + 8, &crc, 4);
    assert_int_equal(r.bytes[12], 0x09); /* field 1, 64 bit */
    assert_memory_equal(r.bytes + 21,
                        "\x10\x00\x1a\x0d"
                        "brain.Event:2",
                        17);
    event_records_free(&r);
    assert_null(r.bytes);
}

static void scalars_are_protobuf(void **state)
{
    (void)state;
    event_records r = {0};
    event_add_scalars(&r, 300, (event_scalar[]){{"a/b", 1.5}, {"c", -2}}, 2);
    static const unsigned char wanted[] = {0x10, 0xac, 0x02, /* step 300 */
                                           0x2a, 22,         /* summary */
                                           0x0a, 10,   0x0a, 3, 'a', '/',  'b',  0x15, 0x00, 0x00,
                                           0xc0, 0x3f, /* value: tag, float */
                                           0x0a, 8,    0x0a, 1, 'c', 0x15, 0x00, 0x00, 0x00, 0xc0};
    assert_int_equal(r.count, 8 + 4 + 9 + sizeof wanted + 4);
    assert_memory_equal(r.bytes + 21, wanted, sizeof wanted);
    event_records_free(&r);
}

static void pictures_are_protobuf(void **state)
{
    (void)state;
    static const unsigned char png[30] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0, 0, 13,
                                          'I',  'H', 'D', 'R', 0,    0,    1,    0,    0, 0, 0, 7};
    static const unsigned char wanted[] = {0x10, 5,    0x2a, 46,   0x0a, 44, 0x0a, 1,  'x',  0x22, 39,  0x08,
                                           7,    0x10, 0x80, 0x02, 0x18, 3,  0x22, 30, 0x89, 'P',  'N', 'G'};
    event_records r = {0};
    event_add_png(&r, 5, "x", png, 23);
    assert_int_equal(r.count, 0); /* too short for a size */
    event_add_png(&r, 5, "x", png, sizeof png);
    assert_memory_equal(r.bytes + 21, wanted, sizeof wanted);
    assert_int_equal(r.count, 8 + 4 + 9 + 2 + 2 + 46 + 4);
    event_records_free(&r);
}

static void damaged_ends_are_cut(void **state)
{
    (void)state;
    event_records r = {0};
    size_t begins[16];
    event_add_version(&r);
    for (uint64_t step = 10; step <= 40; step += 10)
        event_add_scalars(&r, step * 1000, (event_scalar[]){{"loss", 1}}, 1);
    event_add_start(&r, 40000);
    const size_t count = list_records(&r, begins);
    assert_int_equal(count, 6);
    assert_int_equal(event_records_until(r.bytes, r.count, 40000), r.count);
    assert_int_equal(event_records_until(r.bytes, r.count, 39999), begins[4]);
    assert_int_equal(event_records_until(r.bytes, r.count, 10000), begins[2]);
    assert_int_equal(event_records_until(r.bytes, r.count, 0), begins[1]);
    assert_int_equal(event_records_until(NULL, 0, 0), 0);
    for (size_t cut = 0; cut < r.count; cut++) { /* cut anywhere: only whole records stay */
        size_t whole = 0;
        for (size_t i = 1; i < count && begins[i] <= cut; i++)
            whole = begins[i];
        assert_int_equal(event_records_until(r.bytes, cut, UINT64_MAX), whole);
    }
    for (size_t at = 0; at < r.count; at++) { /* a wrong bit anywhere ends it before its record */
        size_t whole = 0;
        for (size_t i = 1; i < count && begins[i] <= at; i++)
            whole = begins[i];
        r.bytes[at] ^= 0x10;
        assert_int_equal(event_records_until(r.bytes, r.count, UINT64_MAX), whole);
        r.bytes[at] ^= 0x10;
    }
    event_records_free(&r);
}

static void without_memory_nothing_is_half(void **state)
{
    (void)state;
    for (long n = 0; n < 8; n++) {
        event_records r = {0};
        mem_fail_after(n);
        event_add_scalars(&r, 1, (event_scalar[]){{"loss", 1}}, 1);
        mem_fail_after(-1);
        assert_true(r.status == GBT_OK || r.count == 0);
        assert_int_equal(event_records_until(r.bytes, r.count, 1), r.count);
        event_records_free(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frame_is_known),
        cmocka_unit_test(scalars_are_protobuf),
        cmocka_unit_test(pictures_are_protobuf),
        cmocka_unit_test(damaged_ends_are_cut),
        cmocka_unit_test(without_memory_nothing_is_half),
    };
    return cmocka_run_group_tests_name("event records", tests, NULL, NULL);
}
