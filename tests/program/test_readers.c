/* The program's readers: every mistake in a file is refused in one line that
 * says where it is and what; good files come out as they are. */
#include "close.h"
#include "scratch.h"

#include "data_file.h"
#include "model_file.h"

#include "jumplink/wire.h"

/* --- data -------------------------------------------------------------- */

static void bad_data_as(const char *path, const struct data_columns *columns,
                        const char *where, const char *what)
{
    struct data_file data;
    const char *said;
    int result;

    capture_begin();
    result = data_read(&data, path, columns);
    said = capture_end();
    if (result == 0)
        print_error("accepted: %s %s\n", where, what);
    assert_int_equal(result, -1);
    assert_null(data.path);
    assert_null(data.time_text);
    assert_int_equal(data.rows, 0);
    check_line(said, path, where, what);
}

static void bad_data(const char *text, const char *where, const char *what)
{
    bad_data_as(scratch_write("bad.csv", text), NULL, where, what);
}

static void good_data(struct data_file *data, const char *text,
                      const struct data_columns *columns)
{
    assert_int_equal(
        data_read(data, scratch_write("good.csv", text), columns), 0);
}

static void test_data_header_mistakes(void **state)
{
    (void)state;
    bad_data("", "bad.csv: ", "empty file");
    bad_data("\nk,z0\n", "bad.csv:1: ", "blank");
    bad_data("k,z0\n", "bad.csv: ", "no rows");
    bad_data("k,z0\n\n\n", "bad.csv: ", "no rows");
    bad_data("k,z0,z0\n1,2,3\n", "bad.csv:1: z0: ", "twice");
    bad_data("k,a,z0,a\n1,2,3,4\n", "bad.csv:1: a: ", "twice");
    bad_data("k,y\n1,2\n", "bad.csv:1: z0: ", "there is: k, y");
    bad_data("k,z0,z2\n1,2,3\n", "bad.csv:1: z1: ", "gaps");
    bad_data("k,z2,z3\n1,2,3\n", "bad.csv:1: z1: ", "gaps");
    bad_data("z0\n1\n", "bad.csv:1: k: ", "there is: z0");
    bad_data("k;z0\n1;2\n", "bad.csv:1: k: ", "there is: k;z0");
}

static void test_data_row_mistakes(void **state)
{
    (void)state;
    bad_data("k,z0,z1\n1,2,3\n2,3\n", "bad.csv:3: z1: ", "2 fields");
    bad_data("k,z0\n1,2\n2,3,4\n", "bad.csv:3: z0: ", "3 fields");
    bad_data("k,z0\n1,2\n\n2,3\n", "bad.csv:3: ", "blank line");
    bad_data("k,z0\n1,2\n2,abc\n", "bad.csv:3: z0: ", "'abc' is not a number");
    bad_data("k,z0\n1,2 3\n", "bad.csv:2: z0: ", "not a number");
    bad_data("k,z0\n1,0x10\n", "bad.csv:2: z0: ", "not a number");
    bad_data("k,z0\n1,1e\n", "bad.csv:2: z0: ", "not a number");
    bad_data("k,z0\n1,-\n", "bad.csv:2: z0: ", "not a number");
    bad_data("k,z0\n1,inf\n", "bad.csv:2: z0: ", "not finite");
    bad_data("k,z0\n1,-Infinity\n", "bad.csv:2: z0: ", "not finite");
    bad_data("k,z0\n1,1e999\n", "bad.csv:2: z0: ", "out of range");
    bad_data("k,z0,z1\n1,2,3\n2,4,\n", "bad.csv:3: z1: ",
             "missing while z0 is there");
    bad_data("k,z0,z1\n1,nan,3\n", "bad.csv:2: z0: ",
             "missing while z1 is there");
    bad_data("k,z0,arrived\n1,2,2\n", "bad.csv:2: arrived: ", "not 0 or 1");
    bad_data("k,z0,arrived\n1,2,0.5\n", "bad.csv:2: arrived: ", "not 0 or 1");
    bad_data("k,z0,arrived\n1,2,\n", "bad.csv:2: arrived: ", "missing");
    bad_data("run,k,z0\n0.5,1,2\n", "bad.csv:2: run: ", "whole number");
    bad_data("run,k,z0\n,1,2\n", "bad.csv:2: run: ", "missing");
    bad_data("run,k,z0\n0,1,2\n1,1,2\n0,2,2\n", "bad.csv:4: run: ",
             "second time");
}

static void test_data_time_mistakes(void **state)
{
    (void)state;
    bad_data("k,z0\n2,1\n1,1\n", "bad.csv:3: k: ", "1 is not after 2");
    bad_data("k,z0\n1,1\n1,1\n", "bad.csv:3: k: ", "1 is not after 1");
    bad_data("t_s,z0\n0.5,1\n0.25,1\n", "bad.csv:3: t_s: ", "not after");
    bad_data("k,z0\n,1\n", "bad.csv:2: k: ", "missing");
    bad_data("k,z0\nnan,1\n", "bad.csv:2: k: ", "missing");
    bad_data("k,z0\ninf,1\n", "bad.csv:2: k: ", "not finite");
    bad_data("k,z0\n1e999,1\n", "bad.csv:2: k: ", "out of range");
    bad_data("run,k,z0\n0,1,2\n0,1,2\n", "bad.csv:3: k: ", "not after");
}

static void test_data_files_that_cannot_be_read(void **state)
{
    static const char zero[] = "k,z0\n1,\0\n";

    (void)state;
    bad_data_as(scratch_path("nothing.csv"), NULL, "nothing.csv: ",
                "No such file");
    bad_data_as(scratch_dir, NULL, "", "directory");
    bad_data_as(scratch_write_octets("zero.csv", zero, sizeof zero - 1), NULL,
                "zero.csv:2: ", "not a text file");
    bad_data("k,z0\n1,\001\033[2J\n", "bad.csv:2: z0: ", "'??[2J'");
}

static void test_data_chosen_columns(void **state)
{
    static const char text[] = "t,k,up,east_m,north_m,v\n"
                               "7,1,x,2,3,\n8.50,2,y,4,5,6\n";
    static const struct data_columns columns = { "north_m,east_m", "t", "v" };
    static const struct data_columns bad[] = {
        { "east_m,west_m", "t", NULL },
        { "east_m", "seconds", NULL },
        { "east_m", "t", "truth" },
        { "east_m,east_m", "t", NULL },
        { "up", "t", NULL }
    };
    struct data_file data;
    const char *path;

    (void)state;
    good_data(&data, text, &columns);
    assert_int_equal(data.rows, 2);
    assert_int_equal(data.m, 2);
    assert_int_equal(data.n_extra, 1);
    assert_string_equal(data.time_name, "t");
    assert_string_equal(data.time_text[1], "8.50");
    assert_close(data.time[1], 8.5, 0);
    assert_close(data.z[0], 3, 0);
    assert_close(data.z[1], 2, 0);
    assert_close(data.z[2], 5, 0);
    assert_true(isnan(data.extra[0]));
    assert_close(data.extra[1], 6, 0);
    assert_null(data.arrived);
    assert_null(data.run);
    data_free(&data);

    path = scratch_write("bad.csv", text);
    bad_data_as(path, &bad[0], "bad.csv:1: west_m: ",
                "there is: t, k, up, east_m, north_m, v");
    bad_data_as(path, &bad[1], "bad.csv:1: seconds: ", "there is: t,");
    bad_data_as(path, &bad[2], "bad.csv:1: truth: ", "there is: t,");
    bad_data_as(path, &bad[3], "bad.csv:1: east_m: ", "twice");
    bad_data_as(path, &bad[4], "bad.csv:2: up: ", "'x' is not a number");
}

static void test_data_spellings_that_are_fine(void **state)
{
    struct data_file data;

    (void)state;
    good_data(&data, "\xEF\xBB\xBFk,z1,z2\r\n 1 , 2,+3e0\r\n2,nan,NaN\r\n"
              "3,,\r\n\r\n\n", NULL);
    assert_int_equal(data.rows, 3);
    assert_int_equal(data.m, 2);
    assert_string_equal(data.time_name, "k");
    assert_string_equal(data.time_text[0], "1");
    assert_close(data.z[1], 3, 0);
    assert_true(isnan(data.z[2]) && isnan(data.z[5]));
    assert_int_equal(data.line[2], 4);
    data_free(&data);

    good_data(&data, "\"name, quoted\",z1,\"z0\",k,t_s\n"
              "\"a \"\"b\"\", c\",1,\"2\",9,-3", NULL);
    assert_string_equal(data.time_name, "t_s");
    assert_close(data.time[0], -3, 0);
    assert_close(data.z[0], 2, 0);
    assert_close(data.z[1], 1, 0);
    data_free(&data);

    good_data(&data, "run,k,z0,arrived\n3,1,1,1\n3,2,1,0\n1,1,1,1\n", NULL);
    assert_int_equal(data.run[1], 3);
    assert_int_equal(data.run[2], 1);
    assert_int_equal(data.arrived[0], 1);
    assert_int_equal(data.arrived[1], 0);
    data_free(&data);
}

static void test_data_long_lines_and_many_rows(void **state)
{
    enum { COLUMNS = 20000, ROWS = 50000 };
    char *text = malloc(40 * (COLUMNS + ROWS)), *p = text;
    struct data_file data;
    int i;

    (void)state;
    assert_non_null(text);
    p += sprintf(p, "k,z0");
    for (i = 0; i < COLUMNS; i++)
        p += sprintf(p, ",c%05d", i % 2 == 0 ? i : COLUMNS + i);
    p += sprintf(p, "\n1,2");
    for (i = 0; i < COLUMNS; i++)
        p += sprintf(p, ",0.000");
    good_data(&data, text, NULL);
    assert_int_equal(data.rows, 1);
    data_free(&data);

    p = text;
    p += sprintf(p, "k,z0\n");
    for (i = 0; i < ROWS; i++)
        p += sprintf(p, "%d,%d\n", i, -i);
    good_data(&data, text, NULL);
    free(text);
    assert_int_equal(data.rows, ROWS);
    assert_close(data.z[ROWS - 1], 1 - ROWS, 0);
    assert_int_equal(data.line[ROWS - 1], ROWS + 1);
    data_free(&data);
}

static void test_data_recorded_flights(void **state)
{
    static const struct { const char *name; long rows; } flights[] = {
        { "carrier_held_1hz", 2499 }, { "glider_irregular", 2697 },
        { "parabolic_1hz", 2000 }, { "sightseeing_1hz", 2757 }
    };
    static const struct data_columns columns = {
        "east_m,north_m", NULL, "v_east_mps,v_north_mps"
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof flights / sizeof flights[0]; i++) {
        char path[500];
        struct data_file data;

        snprintf(path, sizeof path, "%s/sim/data/%s.csv", TOP_DIR,
                 flights[i].name);
        assert_int_equal(data_read(&data, path, &columns), 0);
        assert_int_equal(data.rows, flights[i].rows);
        assert_string_equal(data.time_name, "t_s");
        assert_int_equal(data.n_extra, 2);
        data_free(&data);
    }
}

#if JL_REAL_FLOAT
static void test_data_beyond_float(void **state)
{
    (void)state;
    bad_data("k,z0\n1,1e39\n", "bad.csv:2: z0: ", "out of range");
}
#endif

/* --- models ------------------------------------------------------------ */

static const char matrices[] =
    "{ \"kind\": \"imm\", \"n\": 2, \"m\": 2, \"note\": \"of a test\",\n"
    "  \"Pi\": [[0.75, 0.25], [0.5, 0.5]], \"mu0\": [0.125, 0.875],\n"
    "  \"modes\": [\n"
    "    {\"Phi\": [[1, 2], [0, 1]], \"Gamma\": [[0.5], [1]],\n"
    "     \"Q\": [[4]], \"H\": [[1, 0], [0, 1]],\n"
    "     \"R\": [[9, 1], [1, 9]], \"w_bar\": [3],\n"
    "     \"x0\": [7, 8], \"P0\": [[5, 0], [0, 6]]},\n"
    "    {\"Phi\": [[1, 3], [0, 1]], \"Gamma\": [[1, 0], [0, 1]],\n"
    "     \"Q\": [[1, 0.5], [0.5, 2]], \"H\": [[1, 0], [0, 1]],\n"
    "     \"R\": [[25, 0], [0, 36]], \"name\": \"second\",\n"
    "     \"x0\": [-7, -8], \"P0\": [[1, 0], [0, 0]]}\n"
    "  ] }\n";

static const char catalogue[] =
    "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 3, \"sigma_z\": 20.0,\n"
    "  \"sojourn_s\": [60, 10, 20],\n"
    "  \"modes\": [ {\"type\": \"cv\", \"accel_std\": 0.5},\n"
    "    {\"type\": \"ca\", \"accel_std\": 4.0},\n"
    "    {\"type\": \"ct\", \"turn_rate\": -0.25, \"accel_std\": 1} ] }\n";

static void bad_model_at(const char *path, const char *where, const char *what)
{
    struct model model;
    const char *said;
    int result;

    capture_begin();
    result = model_read(&model, path);
    said = capture_end();
    if (result == 0)
        print_error("accepted: %s %s\n", where, what);
    assert_int_equal(result, -1);
    assert_null(model.path);
    assert_null(model.modes);
    assert_null(model.x0);
    check_line(said, path, where, what);
}

static void bad_model(const char *text, const char *where, const char *what)
{
    bad_model_at(scratch_write("bad.json", text), where, what);
}

/* A model in which the first `old` is replaced: to be freed. */
static char *edited(const char *model, const char *old, const char *new)
{
    const char *at = strstr(model, old);
    char *text;

    assert_non_null(at);
    assert_true(asprintf(&text, "%.*s%s%s", (int)(at - model), model, new,
                         at + strlen(old)) > 0);
    return text;
}

static void bad_edit(const char *model, const char *old, const char *new,
                     const char *where, const char *what)
{
    char *text = edited(model, old, new);

    bad_model(text, where, what);
    free(text);
}

static void good_edit(struct model *read, const char *model, const char *old,
                      const char *new)
{
    char *text = edited(model, old, new);

    assert_int_equal(model_read(read, scratch_write("good.json", text)), 0);
    free(text);
}

struct edit {
    const char *old, *new, *where, *what;
};

static void bad_edits(const char *model, const struct edit *edits)
{
    for (; edits->old != NULL; edits++)
        bad_edit(model, edits->old, edits->new, edits->where, edits->what);
}

static void test_model_matrices(void **state)
{
    static const jl_real F[] = { 1, 3, 0, 1 }, Q[] = { 1, 0.5, 0.5, 2 };
    static const jl_real W[] = { 1, 2, 2, 4 }, u[] = { 1.5, 3 };
    static const jl_real P0[] = { 5, 0, 0, 6, 1, 0, 0, 0 };
    struct model model;
    jl_u32 crc = jl_crc32(0, (const unsigned char *)matrices,
                          (int)sizeof matrices - 1);

    (void)state;
    assert_int_equal(model_read(&model, scratch_write("m.json", matrices)), 0);
    assert_int_equal(model.M, 2);
    assert_int_equal(model.n, 2);
    assert_int_equal(model.m, 2);
    assert_int_equal(model.modes[0].p, 1);
    assert_int_equal(model.modes[1].p, 2);
    assert_same_bits(model.modes[1].F, F, sizeof F);
    assert_same_bits(model.modes[1].W, Q, sizeof Q);
    assert_same_bits(model.modes[0].W, W, sizeof W);
    assert_same_bits(model.modes[0].u, u, sizeof u);
    assert_same_bits(model.P0, P0, sizeof P0);
    assert_close(model.Pi[1], 0.25, 0);
    assert_close(model.mu0[1], 0.875, 0);
    assert_close(model.x0[3], -8, 0);
    assert_null(model.motions);
    assert_null(model.sojourn_s);
    assert_true(model.fingerprint == crc);
    model_free(&model);
}

static void test_model_catalogue(void **state)
{
    struct model model;

    (void)state;
    assert_int_equal(model_read(&model, scratch_write("c.json", catalogue)), 0);
    assert_int_equal(model.M, 3);
    assert_int_equal(model.n, 6);
    assert_int_equal(model.m, 2);
    assert_int_equal(model.modes[2].p, 2);
    assert_int_equal(model.motions[0].kind, JL_MOTION_CV);
    assert_int_equal(model.motions[1].kind, JL_MOTION_CA);
    assert_int_equal(model.motions[2].kind, JL_MOTION_CT);
    assert_close(model.motions[2].turn_rate, -0.25, 0);
    assert_close(model.motions[2].sigma_z, 20, 0);
    assert_close(model.motions[1].accel_std, 4, 0);
    assert_close(model.sojourn_s[2], 20, 0);
    assert_close(model.mu0[2], 1 / (jl_real)3, 0);
    assert_close(model.v0_std, 100, 0);
    assert_close(model.a0_std, 10, 0);
    assert_null(model.Pi);
    assert_null(model.x0);
    assert_null(model.P0);
    model_free(&model);

    good_edit(&model, catalogue, "\"sojourn_s\": [60, 10, 20],",
              "\"Pi\": [[1,0,0],[0,1,0],[0,0.5,0.5]], \"mu0\": [0,0,1],"
              "\"v0_std\": 30, \"a0_std\": 3,");
    assert_null(model.sojourn_s);
    assert_close(model.Pi[7], 0.5, 0);
    assert_close(model.mu0[0], 0, 0);
    assert_close(model.v0_std, 30, 0);
    assert_close(model.a0_std, 3, 0);
    model_free(&model);
}

/* x0, P0 once at the top serve every mode. */
static void test_model_start_at_the_top(void **state)
{
    struct model model;
    char *text = edited(catalogue, "\"order\": 3", "\"order\": 2, \"x0\": "
                        "[1,2,3,4], \"P0\": [[1,0,0,0],[0,2,0,0],[0,0,3,0],"
                        "[0,0,0,4]]");

    (void)state;
    good_edit(&model, text, "\"ca\"", "\"cv\"");
    assert_close(model.x0[4], 1, 0);
    assert_close(model.x0[11], 4, 0);
    assert_close(model.P0[2 * 16 + 15], 4, 0);
    model_free(&model);
    free(text);
}

static void test_model_mistakes_of_json(void **state)
{
    static const struct edit edits[] = {
        { "\"n\": 2,", "\"n\": 2,,", "bad.json:1: column ", "not JSON" },
        { "7, 8]", "7, 8", "bad.json:7: column ", "not JSON" },
        { "[7, 8]", "[NaN, 8]", "bad.json:7: column ", "not JSON" },
        { "[7, 8]", "[1e999, 8]", "bad.json:7: column ", "overflow" },
        { "\"m\": 2", "\"n\": 2", "bad.json:1: ", "uplicate" },
        { "\"kind\": \"imm\"", "\"kind\": 3", "json: kind: ", "a number" },
        { "\"kind\": \"imm\",", "", "json: kind: ", "missing" },
        { "\"imm\"", "\"particle\"", "json: kind: ",
          "'particle' is not supported by this version" },
        { "\"imm\"", "\"imm2\"", "json: kind: ", "'imm2' is unknown" },
        { NULL, NULL, NULL, NULL }
    };

    (void)state;
    bad_edits(matrices, edits);
    bad_model("", "bad.json:1: ", "not JSON");
    bad_model("[1]", "bad.json: ", "not an object");
    bad_model("{}", "bad.json: kind: ", "missing");
    bad_model_at(scratch_path("nothing.json"), "nothing.json: ",
                 "No such file");
    bad_model_at(scratch_dir, "", "directory");
}

static void test_model_mistakes_of_keys_and_shapes(void **state)
{
    static const struct edit edits[] = {
        { "\"note\"", "\"nota\"", "json: nota: ", "unknown key" },
        { "\"of a test\"", "5", "json: note: ", "must be a text" },
        { "\"w_bar\"", "\"wbar\"", "modes[0].wbar: ", "unknown key" },
        { "\"n\": 2,", "", "json: n: ", "missing" },
        { "\"n\": 2", "\"n\": 0", "json: n: ", "1 to 64, is 0" },
        { "\"n\": 2", "\"n\": 65", "json: n: ", "1 to 64, is 65" },
        { "\"n\": 2", "\"n\": 1.5", "json: n: ", "whole number" },
        { "\"n\": 2", "\"n\": \"2\"", "json: n: ", "is a text" },
        { "\"m\": 2", "\"m\": -1", "json: m: ", "1 to 64, is -1" },
        { "\"m\": 2", "\"m\": 1", "modes[0].H: ", "1 rows, has 2" },
        { "\"Pi\"", "\"pi\"", "json: pi: ", "unknown key" },
        { "\"Pi\": [[0.75, 0.25], [0.5, 0.5]],", "", "json: Pi: ", "missing" },
        { "\"mu0\": [0.125, 0.875],", "", "json: mu0: ", "missing" },
        { "[[1, 2], [0, 1]]", "[[1, 2]]", "modes[0].Phi: ",
          "2 rows, has 1" },
        { "[[1, 2], [0, 1]]", "[[1, 2], [0]]", "modes[0].Phi[1]: ",
          "2 numbers, has 1" },
        { "[[1, 2], [0, 1]]", "[[1, 2], 3]", "modes[0].Phi[1]: ",
          "an array of 2 numbers, is a number" },
        { "[[1, 2], [0, 1]]", "[[1, 2], [0, true]]", "modes[0].Phi[1][1]: ",
          "is true or false" },
        { "[[1, 2], [0, 1]]", "[[1, 2], [0, null]]", "modes[0].Phi[1][1]: ",
          "is null" },
        { "\"Gamma\": [[0.5], [1]],", "", "modes[0].Gamma: ", "missing" },
        { "[[0.5], [1]]", "[0.5, 1]", "modes[0].Gamma: ", "rows" },
        { "[[0.5], [1]]", "[[], []]", "modes[0].Gamma: ", "1 to 64 numbers" },
        { "[[0.5], [1]]", "[[0.5, 1], [1]]", "modes[0].Gamma[1]: ",
          "2 numbers, has 1" },
        { "[[4]]", "[4]", "modes[0].Q[0]: ", "array" },
        { "\"w_bar\": [3]", "\"w_bar\": [3, 4]", "modes[0].w_bar: ",
          "1 numbers, has 2" },
        { "[7, 8]", "[7]", "modes[0].x0: ", "2 numbers, has 1" },
        { "[7, 8]", "{}", "modes[0].x0: ", "is an object" },
        { "\"x0\": [7, 8], ", "", "modes[0].x0: ", "missing while P0" },
        { "\"P0\": [[5, 0], [0, 6]]", "\"note\": \"\"", "modes[0].P0: ",
          "missing while x0" },
        { "\"x0\": [-7, -8], \"P0\": [[1, 0], [0, 0]]", "\"note\": \"\"",
          "modes[1].x0: ", "missing, but in modes[0]" },
        { "\"x0\": [7, 8], \"P0\": [[5, 0], [0, 6]]", "\"note\": \"\"",
          "modes[1].x0: ", "not in modes[0]" },
        { "\"note\"", "\"x0\": [1, 2], \"P0\": [[1, 0], [0, 1]], \"note\"",
          "modes[0].x0: ", "at the top" },
        { "\"modes\"", "\"nodes\"", "json: modes: ", "missing" },
        { "{\"Phi\": [[1, 3]", "7, {\"Phi\": [[1, 3]", "modes[1]: ",
          "must be an object" },
        { NULL, NULL, NULL, NULL }
    };
    char *once, *twice;

    (void)state;
    bad_edits(matrices, edits);

    once = edited(matrices, "\"x0\": [7, 8], \"P0\": [[5, 0], [0, 6]]",
                  "\"name\": \"\"");
    twice = edited(once, "\"x0\": [-7, -8], \"P0\": [[1, 0], [0, 0]]",
                   "\"note\": \"\"");
    bad_model(twice, "json: x0: ", "only a model of the catalogue");
    free(once);
    free(twice);
    bad_model("{\"kind\": \"imm\", \"modes\": []}", "json: modes: ",
              "has 0");
    bad_model("{\"kind\": \"imm\", \"modes\": {}}", "json: modes: ",
              "must be an array");
}

static void test_model_mistakes_of_numbers(void **state)
{
    static const struct edit edits[] = {
        { "0.75, 0.25", "0.75, 0.2501", "json: Pi[0]: ", "not to 1" },
        { "0.75, 0.25", "1.25, -0.25", "json: Pi[0][1]: ", "not negative" },
        { "0.75, 0.25", "0.75, 0.15", "json: Pi[0]: ", "sums to 1-0.1," },
        { "0.125, 0.875", "0.125, 0.8", "json: mu0: ", "not to 1" },
        { "0.125, 0.875", "-0.125, 1.125", "json: mu0[0]: ", "not negative" },
        { "[[1, 2]", "[[1, 1e200]", "modes[0].Phi[0][1]: ", "too large" },
        { "[[9, 1], [1, 9]]", "[[9, 1], [2, 9]]", "modes[0].R[0][1]: ",
          "symmetric" },
        { "[[9, 1], [1, 9]]", "[[1, 2], [2, 1]]", "modes[0].R: ",
          "not positive definite" },
        { "[[9, 1], [1, 9]]", "[[1, 1], [1, 1]]", "modes[0].R: ",
          "not positive definite" },
        { "[[9, 1], [1, 9]]", "[[0, 0], [0, 9]]", "modes[0].R: ",
          "not positive definite" },
        { "[[4]]", "[[-4]]", "modes[0].Q: ", "not positive semidefinite" },
        { "[0.5, 2]", "[0.25, 2]", "modes[1].Q[0][1]: ", "symmetric" },
        { "[[5, 0], [0, 6]]", "[[5, 0], [0, -6]]", "modes[0].P0: ",
          "not positive semidefinite" },
        { "[[5, 0], [0, 6]]", "[[5, 1], [0, 6]]", "modes[0].P0[0][1]: ",
          "symmetric" },
        { "[[5, 0], [0, 6]]", "[[5, 1], [1, 0]]", "modes[0].P0: ",
          "not positive semidefinite" },
        { "[[5, 0], [0, 6]]", "[[5, 0], [0, 1e305]]", "modes[0].P0[1][1]: ",
          "too large" },
        { NULL, NULL, NULL, NULL }
    };
#if JL_REAL_FLOAT
    static const struct edit floats[] = {
        { "[7, 8]", "[1e39, 8]", "modes[0].x0[0]: ", "too large" },
        { "[[4]]", "[[1e39]]", "modes[0].Q[0][0]: ", "too large" },
        { "[[9, 1], [1, 9]]", "[[1e-60, 0], [0, 1]]", "modes[0].R: ",
          "not positive definite" },
        { NULL, NULL, NULL, NULL }
    };

    bad_edits(matrices, floats);
#else
    bad_edit(matrices, "0.75, 0.25", "0.75, 0.250000002", "json: Pi[0]: ",
             "not to 1");
#endif
    (void)state;
    bad_edits(matrices, edits);
}

/* Deviations that fit, with squares that do not. */
#if JL_REAL_FLOAT
#define HUGE_STD "1e10"
#define TINY_STD "1e-25"
#else
#define HUGE_STD "1e80"
#define TINY_STD "1e-200"
#endif

static void test_model_mistakes_of_the_catalogue(void **state)
{
    static const struct edit edits[] = {
        { "\"axes\": 2", "\"axes\": 0", "json: axes: ", "is 0" },
        { "\"axes\": 2", "\"axes\": 40", "json: axes: ", "is 40" },
        { "\"axes\": 2", "\"axes\": 3", "modes[2].type: ", "ct needs axes 2" },
        { "\"axes\": 2,", "", "json: axes: ", "missing" },
        { "\"order\": 3", "\"order\": 4", "json: order: ", "2 to 3, is 4" },
        { "\"order\": 3", "\"order\": 2", "modes[1].type: ",
          "ca needs order 3" },
        { "\"cv\"", "\"cv\", \"order\": 1", "modes[0].order: ",
          "2 to 3, is 1" },
        { "\"cv\"", "\"cv\", \"order\": 4", "modes[0].order: ",
          "2 to 3, is 4" },
        { "\"cv\"", "\"cv\", \"order\": \"2\"", "modes[0].order: ",
          "whole number" },
        { "\"ca\"", "\"ca\", \"order\": 2", "modes[1].type: ",
          "ca needs order 3" },
        { "\"sigma_z\": 20.0,", "", "json: sigma_z: ", "missing" },
        { "20.0", "0", "json: sigma_z: ", "above 0" },
        { "20.0", HUGE_STD, "json: modes[0]: ", "not finite or too large" },
        { "20.0", "20, \"v0_std\": 0", "json: v0_std: ", "above 0" },
        { "20.0", "20, \"a0_std\": -1", "json: a0_std: ", "above 0" },
        { "20.0", "20, \"n\": 4", "json: n: ", "unknown key" },
        { "\"cv\"", "\"cw\"", "modes[0].type: ", "'cw' is not cv, ca, ct or singer" },
        { "\"type\": \"ca\", ", "", "modes[1].type: ", "missing" },
        { "0.5}", "-0.5}", "modes[0].accel_std: ", "not negative" },
        { "0.5}", "\"0.5\"}", "modes[0].accel_std: ", "must be a number" },
        { "0.5}", "0.5, \"turn_rate\": 1}", "modes[0].turn_rate: ",
          "unknown key" },
        { "\"turn_rate\": -0.25,", "", "modes[2].turn_rate: ", "missing" },
        { "\"ca\"", "\"singer\"", "modes[1].tau_s: ", "missing" },
        { "\"ca\"", "\"singer\", \"tau_s\": 0", "modes[1].tau_s: ",
          "0: must be above 0" },
        { "\"ca\"", "\"singer\", \"tau_s\": -3", "modes[1].tau_s: ",
          "-3: must be above 0" },
        { "\"ca\"", "\"singer\", \"tau_s\": \"3\"", "modes[1].tau_s: ",
          "must be a number" },
        { "\"ca\"", "\"singer\", \"tau_s\": " HUGE_STD, "json: modes[1]: ",
          "not finite or too large" },
        { "\"ca\"", "\"singer\", \"tau_s\": 3, \"turn_rate\": 1",
          "modes[1].turn_rate: ", "unknown key" },
        { "\"ca\"", "\"ca\", \"tau_s\": 3", "modes[1].tau_s: ",
          "unknown key" },
        { "[60, 10, 20]", "[60, 10]", "json: sojourn_s: ",
          "3 numbers, has 2" },
        { "[60, 10, 20]", "[60, 0, 20]", "json: sojourn_s[1]: ", "above 0" },
        { "\"sojourn_s\": [60, 10, 20],", "", "json: sojourn_s: ",
          "no Pi either" },
        { "\"sojourn_s\"", "\"Pi\": [[1]], \"sojourn_s\"",
          "json: sojourn_s: ", "Pi, too" },
        { "\"sojourn_s\"", "\"mu0\": [1, 0], \"sojourn_s\"", "json: mu0: ",
          "3 numbers, has 2" },
        { NULL, NULL, NULL, NULL }
    };

    (void)state;
    bad_edits(catalogue, edits);
}

/* A catalogue's mode with more noises than others: order, sizes, numbers. */
static void test_model_takes_singer(void **state)
{
    static const char text[] =
        "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 3, "
        "\"sigma_z\": 20.0,\n"
        "  \"sojourn_s\": [60, 10, 20],\n"
        "  \"modes\": [ {\"type\": \"singer\", \"tau_s\": 12.5, "
        "\"accel_std\": 0.5},\n"
        "    {\"type\": \"cv\", \"accel_std\": 4},\n"
        "    {\"type\": \"singer\", \"accel_std\": 2, \"tau_s\": 3} ] }\n";
    struct model model;

    (void)state;
    assert_int_equal(model_read(&model, scratch_write("m.json", text)), 0);
    assert_int_equal(model.n, 6);
    assert_int_equal(model.m, 2);
    assert_int_equal(model.modes[0].p, 6);
    assert_int_equal(model.modes[1].p, 2);
    assert_int_equal(model.modes[2].p, 6);
    assert_int_equal(model.motions[0].kind, JL_MOTION_SINGER);
    assert_close(model.motions[0].tau_s, 12.5, 0);
    assert_close(model.motions[0].accel_std, 0.5, 0);
    assert_close(model.motions[2].tau_s, 3, 0);
    model_free(&model);
    bad_model("{ \"kind\": \"imm\", \"axes\": 1, \"order\": 2, "
              "\"sigma_z\": 1, \"sojourn_s\": [1], \"modes\": "
              "[ {\"type\": \"singer\", \"tau_s\": 1, \"accel_std\": 1} ] }",
              "modes[0].type: ", "singer needs order 3");
}

/* A mode of order 2 in a model of order 3: maps, the prior, starts. */
static void test_model_takes_mixed_orders(void **state)
{
    static const char two_kinds[] =
        "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 3, \"sigma_z\": 20.0,\n"
        "  \"a0_std\": 3, \"sojourn_s\": [60, 10, 20], \"modes\": [\n"
        "    {\"type\": \"cv\", \"order\": 2, \"accel_std\": 0.5,\n"
        "     \"x0\": [1, 2, 3, 4], \"P0\": [[1,0,0,0], [0,2,0,0.5],\n"
        "     [0,0,3,0], [0,0.5,0,4]]},\n"
        "    {\"type\": \"ca\", \"order\": 3, \"accel_std\": 4.0,\n"
        "     \"x0\": [5,6,7,8,9,10], \"P0\": [[1,0,0,0,0,0], [0,2,0,0,0,0],\n"
        "     [0,0,3,0,0,0], [0,0,0,4,0,0], [0,0,0,0,5,0], [0,0,0,0,0,6]]},\n"
        "    {\"type\": \"ct\", \"order\": 2, \"turn_rate\": 1,\n"
        "     \"accel_std\": 1, \"x0\": [0,0,0,0], \"P0\": [[1,0,0,0],\n"
        "     [0,1,0,0], [0,0,1,0], [0,0,0,1]]} ] }\n";
    static const int map[4] = { 0, 1, 3, 4 };
    static const char all_two[] =
        "{ \"kind\": \"imm\", \"axes\": 1, \"order\": 3, \"sigma_z\": 1, "
        "\"sojourn_s\": [1], \"modes\": [ {\"type\": \"cv\", "
        "\"order\": 2, \"accel_std\": 1} ] }";
    struct model model;
    char *text;

    (void)state;
    assert_int_equal(model_read(&model, scratch_write("m.json", two_kinds)),
                     0);
    assert_int_equal(model.n, 6);
    assert_int_equal(model.modes[0].n, 4);
    assert_int_equal(model.modes[1].n, 6);
    assert_int_equal(model.modes[2].n, 4);
    assert_int_equal(model.motions[0].order, 2);
    assert_int_equal(model.motions[1].order, 3);
    assert_memory_equal(model.map[0], map, sizeof map);
    assert_memory_equal(model.map[2], map, sizeof map);
    assert_close(model.prior_var[2], 9, 0);
    assert_close(model.prior_var[5], 9, 0);
    assert_close(model.prior_x[5], 0, 0);
    assert_close(model.x0[1], 2, 0);
    assert_close(model.x0[3], 3, 0);
    assert_close(model.x0[6 + 5], 10, 0);
    assert_close(model.P0[4 * 6 + 1], 0.5, 0);
    assert_close(model.P0[4 * 6 + 4], 4, 0);
    assert_close(model.P0[36 + 35], 6, 0);
    model_free(&model);
    text = edited(two_kinds, "[1, 2, 3, 4]", "[1, 2, 0, 3, 4, 0]");
    bad_model(text, "modes[0].x0: ", "4 numbers, has 6");
    free(text);
    bad_edit(two_kinds, "\"a0_std\": 3", "\"a0_std\": " TINY_STD,
             "json: a0_std: ", "its square is 0");
    bad_model(all_two, "json: order: ", "3, but every mode has order 2");
    text = edited(all_two, "\"order\": 3", "\"order\": 2");
    assert_int_equal(model_read(&model, scratch_write("m.json", text)), 0);
    assert_null(model.map);
    model_free(&model);
    free(text);
    text = edited(all_two, "\"order\": 3", "\"order\": 2");
    bad_edit(text, "\"cv\", \"order\": 2", "\"cv\", \"order\": 3",
             "modes[0].order: ", "3, but at the top it is 2");
    free(text);
}

static void test_model_reference_cases(void **state)
{
    static const struct { const char *name; int M, n, m; } cases[] = {
        { "tests/golden/imm/bank12/model", 12, 4, 2 },
        { "tests/golden/imm/cvca3/model", 2, 3, 1 },
        { "tests/golden/imm/cvct4/model", 3, 4, 2 },
        { "tests/golden/imm/evidence/model", 2, 2, 1 },
        { "tests/golden/imm/hard/model", 2, 3, 1 },
        { "tests/golden/imm/hardest/model", 2, 3, 1 },
        { "tests/golden/imm/meannoise/model", 3, 2, 1 },
        { "sim/data/two_modes", 2, 4, 2 },
        { "sim/data/eight_modes", 8, 4, 2 }
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char path[500];
        struct model model;

        snprintf(path, sizeof path, "%s/%s.json", TOP_DIR, cases[i].name);
        assert_int_equal(model_read(&model, path), 0);
        assert_int_equal(model.M, cases[i].M);
        assert_int_equal(model.n, cases[i].n);
        assert_int_equal(model.m, cases[i].m);
        assert_true((model.x0 != NULL) == (model.motions == NULL));
        model_free(&model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_data_header_mistakes),
        cmocka_unit_test(test_data_row_mistakes),
        cmocka_unit_test(test_data_time_mistakes),
        cmocka_unit_test(test_data_files_that_cannot_be_read),
        cmocka_unit_test(test_data_chosen_columns),
        cmocka_unit_test(test_data_spellings_that_are_fine),
        cmocka_unit_test(test_data_long_lines_and_many_rows),
        cmocka_unit_test(test_data_recorded_flights),
#if JL_REAL_FLOAT
        cmocka_unit_test(test_data_beyond_float),
#endif
        cmocka_unit_test(test_model_matrices),
        cmocka_unit_test(test_model_catalogue),
        cmocka_unit_test(test_model_start_at_the_top),
        cmocka_unit_test(test_model_mistakes_of_json),
        cmocka_unit_test(test_model_mistakes_of_keys_and_shapes),
        cmocka_unit_test(test_model_mistakes_of_numbers),
        cmocka_unit_test(test_model_mistakes_of_the_catalogue),
        cmocka_unit_test(test_model_takes_singer),
        cmocka_unit_test(test_model_takes_mixed_orders),
        cmocka_unit_test(test_model_reference_cases)
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
