/* SPDX-License-Identifier: Apache-2.0 */
/* tests/pose/test_frames.c -- sharpness of pictures, and which frames of a film are chosen. */
#include "pose/frames.h"
#include "test_support.h"

enum { SIDE = 64, FRAMES = 1000, WANTED = 50 };

static void test_sharpness_falls_with_blur(void **state)
{
    (void)state;
    unsigned char picture[SIDE * SIDE], blurred[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++)
        picture[i] = (unsigned char)((i / SIDE / 4 + i % SIDE / 4) % 2 * 200);
    double before = frames_sharpness(picture, SIDE, SIDE);
    for (int pass = 0; pass < 3; pass++) {
        memcpy(blurred, picture, sizeof picture);
        for (int y = 1; y < SIDE - 1; y++)
            for (int x = 1; x < SIDE - 1; x++) {
                int sum = 0;
                for (int k = 0; k < 9; k++)
                    sum += picture[(y + k / 3 - 1) * SIDE + x + k % 3 - 1];
                blurred[y * SIDE + x] = (unsigned char)(sum / 9);
            }
        memcpy(picture, blurred, sizeof picture);
        const double now = frames_sharpness(picture, SIDE, SIDE);
        assert_true(now < before);
        before = now;
    }
    memset(picture, 90, sizeof picture);
    assert_true(frames_sharpness(picture, SIDE, SIDE) == 0);
    assert_true(frames_sharpness(picture, 2, SIDE) == 0);
}

/* By definition: x of a row of five with one bright pixel in the middle of 3 x 3. */
static void test_sharpness_is_the_variance(void **state)
{
    (void)state;
    const unsigned char picture[3 * 4] = {0, 0, 0, 0, 0, 10, 0, 0, 0, 0, 0, 0};
    /* Laplacians of the two inner pixels: -40 and 10. */
    assert_true(fabs(frames_sharpness(picture, 4, 3) - 25.0 * 25.0) < 1e-9);
}

static void check_order(const size_t *chosen, size_t count, size_t frames)
{
    for (size_t i = 0; i < count; i++) {
        assert_true(chosen[i] < frames);
        assert_true(i == 0 || chosen[i] > chosen[i - 1]);
    }
}

static void test_sharp_frames_are_chosen(void **state)
{
    (void)state;
    static frame_measure frames[FRAMES];
    size_t chosen[WANTED];
    for (int i = 0; i < FRAMES; i++)
        frames[i] = (frame_measure){.sharpness = i % 5 == 2 ? 100 : 10, .change = 1};
    assert_int_equal(frames_choose(frames, FRAMES, WANTED, chosen), WANTED);
    check_order(chosen, WANTED, FRAMES);
    for (size_t i = 0; i < WANTED; i++)
        assert_true(chosen[i] % 5 == 2);
}

/* A camera that stands still for the first half: most frames come from the second, where it moves. */
static void test_movement_counts(void **state)
{
    (void)state;
    static frame_measure frames[FRAMES];
    size_t chosen[WANTED], early = 0;
    for (int i = 0; i < FRAMES; i++)
        frames[i] = (frame_measure){.sharpness = 1, .change = i < FRAMES / 2 ? 0 : 3};
    assert_int_equal(frames_choose(frames, FRAMES, WANTED, chosen), WANTED);
    check_order(chosen, WANTED, FRAMES);
    for (size_t i = 0; i < WANTED; i++)
        early += chosen[i] < FRAMES / 2;
    assert_in_range(early, WANTED / 4 - 2, WANTED / 4 + 2);
}

/* Cuts, standing still, few frames: always as many as wanted, in order, none twice. */
static void test_odd_films(void **state)
{
    (void)state;
    static frame_measure frames[FRAMES];
    size_t chosen[FRAMES];
    for (size_t count = 1; count < 60; count++)
        for (size_t wanted = 1; wanted < 70; wanted++)
            for (int kind = 0; kind < 3; kind++) {
                for (size_t i = 0; i < count; i++)
                    frames[i] = (frame_measure){.sharpness = (double)(i * 7 % 11),
                                                .change = kind == 0   ? 0
                                                          : kind == 1 ? (i == count / 2)
                                                                      : i % 9 == 0};
                const size_t found = frames_choose(frames, count, wanted, chosen);
                assert_int_equal(found, wanted < count ? wanted : count);
                check_order(chosen, found, count);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sharpness_falls_with_blur),
        cmocka_unit_test(test_sharpness_is_the_variance),
        cmocka_unit_test(test_sharp_frames_are_chosen),
        cmocka_unit_test(test_movement_counts),
        cmocka_unit_test(test_odd_films),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
