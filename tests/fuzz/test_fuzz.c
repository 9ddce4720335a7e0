/* The fuzz targets over the corpus, over mutations of it, the same on every
 * run, and over nothing at all. */
#include "close.h"
#include "fuzz.h"

#include <signal.h>
#include <stdlib.h>

enum { SEEDS = 400, LONGEST = 4096 };

struct seed {
    unsigned char *octets;
    size_t size;
};

static struct seed seeds[SEEDS];
static int seed_count;
static unsigned char input[LONGEST];
static size_t input_size;
static unsigned random_state;

/* --- what is run when a promise is broken -------------------------------- */

/* As a line for the corpus. */
static void say_input(int number)
{
    size_t i;

    fprintf(stderr, "the input:\n");
    for (i = 0; i < input_size; i++)
        fprintf(stderr, "%02x", input[i]);
    fprintf(stderr, "\n");
    signal(number, SIG_DFL);
    raise(number);
}

/* --- the corpus ---------------------------------------------------------- */

static void read_corpus(const char *target)
{
    char path[400];
    FILE *stream;
    int n;

    snprintf(path, sizeof path, TOP_DIR "/tests/fuzz/corpus/%s.hex", target);
    stream = fopen(path, "r");
    assert_non_null(stream);
    while ((n = fuzz_read(stream, input, LONGEST)) >= 0) {
        struct seed *seed = &seeds[seed_count++];

        assert_in_range(seed_count, 1, SEEDS);
        seed->size = (size_t)n;
        seed->octets = malloc(seed->size + 1);
        assert_non_null(seed->octets);
        memcpy(seed->octets, input, seed->size);
    }
    assert_int_equal(n, -1);
    assert_true(seed_count > 0);
    fclose(stream);
}

static void forget_corpus(void)
{
    while (seed_count > 0)
        free(seeds[--seed_count].octets);
}

/* --- mutations ----------------------------------------------------------- */

static size_t dice(size_t n)
{
    random_state = random_state * 1664525u + 1013904223u;
    return n == 0 ? 0 : (random_state >> 8) % n;
}

static void insert(size_t at, const unsigned char *p, size_t n)
{
    if (n > LONGEST - input_size)
        n = LONGEST - input_size;
    memmove(input + at + n, input + at, input_size - at);
    memmove(input + at, p, n);
    input_size += n;
}

static void erase(size_t at, size_t n)
{
    if (n > input_size - at)
        n = input_size - at;
    memmove(input + at, input + at + n, input_size - at - n);
    input_size -= n;
}

static void mutate(void)
{
    const struct seed *other = &seeds[dice((size_t)seed_count)];
    size_t at = dice(input_size + 1), from = dice(other->size);
    unsigned char some[8];
    size_t i;

    for (i = 0; i < sizeof some; i++)
        some[i] = (unsigned char)dice(256);
    switch (dice(6)) {
    case 0: if (at < input_size) input[at] = some[0]; break;
    case 1: if (at < input_size) input[at] ^= (unsigned char)(1 << some[0] % 8);
        break;
    case 2: insert(at, some, 1 + dice(sizeof some)); break;
    case 3: erase(at, 1 + dice(16)); break;
    case 4: insert(at, other->octets + from, dice(other->size - from)); break;
    case 5: input_size = at; break;
    }
}

static void take(const struct seed *seed)
{
    memcpy(input, seed->octets, seed->size);
    input_size = seed->size;
}

static void run(int (*target)(const unsigned char *data, size_t size),
                const char *name, int mutations)
{
    int i, k;

    read_corpus(name);
    random_state = 1;
    input_size = 0;
    target(input, 0);
    for (i = 0; i < seed_count; i++) {
        take(&seeds[i]);
        target(input, input_size);
    }
    for (i = 0; i < mutations; i++) {
        take(&seeds[dice((size_t)seed_count)]);
        for (k = (int)dice(4); k >= 0; k--)
            mutate();
        target(input, input_size);
    }
    forget_corpus();
}

static void test_fuzz_wire(void **state)
{
    (void)state;
    run(fuzz_wire, "wire", 300000);
}

static void test_fuzz_link(void **state)
{
    (void)state;
    run(fuzz_link, "link", 50000);
}

static void test_fuzz_par(void **state)
{
    (void)state;
    run(fuzz_par, "par", 20000);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fuzz_wire),
        cmocka_unit_test(test_fuzz_link),
        cmocka_unit_test(test_fuzz_par),
    };

    signal(SIGABRT, say_input);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
