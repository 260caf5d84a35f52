/* Tests of c/core: random numbers, box arithmetic, hashes, names. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "core/box.h"
#include "core/random.h"
#include "core/sha256.h"
#include "core/text.h"

/* Known answers of the Random123 distribution for philox4x32-10. */
static void philox_known_answers(void **state)
{
    (void)state;
    static const uint32_t full = 0xffffffffu;
    struct gbg_philox zero = gbg_philox((struct gbg_philox){{0, 0, 0, 0}}, 0, 0);
    struct gbg_philox ones = gbg_philox((struct gbg_philox){{full, full, full, full}}, full, full);
    struct gbg_philox pi = gbg_philox(
        (struct gbg_philox){{0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u}}, 0xa4093822u,
        0x299f31d0u);
    static const uint32_t expected[3][4] = {{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8},
                                            {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd},
                                            {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}};
    assert_memory_equal(zero.word, expected[0], sizeof expected[0]);
    assert_memory_equal(ones.word, expected[1], sizeof expected[1]);
    assert_memory_equal(pi.word, expected[2], sizeof expected[2]);
}

static void sha256_known_answers(void **state)
{
    (void)state;
    struct gbg_sha256 hash;
    unsigned char digest[32];
    char text[65];
    gbg_sha256_start(&hash);
    gbg_sha256_add(&hash, "abc", 3);
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
    assert_string_equal(text, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");

    gbg_sha256_start(&hash);
    for (int i = 0; i < 1000000; i++) {
        gbg_sha256_add(&hash, "a", 1);
    }
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
    assert_string_equal(text, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

static void box_wraps_and_takes_the_nearest_image(void **state)
{
    (void)state;
    double length[2] = {10.0, 7.0}, origin[2] = {-5.0, 2.0};
    struct gbg_box box = gbg_box_make(2, length, origin);
    int32_t image;
    uint64_t a = gbg_box_encode(&box, 0, 4.9, NULL), b = gbg_box_encode(&box, 0, -4.9, NULL);
    assert_true(fabs(gbg_box_difference(&box, 0, b, a) - 0.2) < 1e-14);
    uint64_t far = gbg_box_encode(&box, 1, 2.0 + 7.0 * 1000 + 3.5, &image);
    assert_int_equal(image, 1000);
    assert_true(fabs(gbg_box_decode(&box, 1, far) - 5.5) < 1e-11);
    uint64_t below = gbg_box_encode(&box, 0, -5.0 - 1e-18, &image);
    assert_int_equal(image, 0);
    assert_int_equal(below, 0);
    assert_true(gbg_box_decode(&box, 0, UINT64_MAX) < 5.0);
}

static void names_find_their_neighbours(void **state)
{
    (void)state;
    static const char *const list[] = {"power", "cutoff", "tolerance", NULL};
    assert_string_equal(gbg_text_nearest("cut_off", list), "cutoff");
    assert_int_equal(gbg_text_find("tolerance", list), 2);
    assert_int_equal(gbg_text_find("tol", list), -1);
    assert_int_equal(gbg_text_distance("kitten", "sitting"), 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(philox_known_answers),
        cmocka_unit_test(sha256_known_answers),
        cmocka_unit_test(box_wraps_and_takes_the_nearest_image),
        cmocka_unit_test(names_find_their_neighbours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
