/* Turns the reference cases of the IMM into C tables, so that the same test
 * runs on a PC and on a board:  gen_golden DIR > imm_cases.h
 * DIR holds one folder a case: model.json, z.csv, expected.csv. */
#include <dirent.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void fail(const char *what, const char *where)
{
    fprintf(stderr, "gen_golden: %s: %s\n", where, what);
    exit(1);
}

/* All numbers of a JSON value, depth first; how many. */
static int put_numbers(const json_t *value)
{
    size_t i;
    int count = 0;

    if (json_is_number(value)) {
        printf("%.17g,", json_number_value(value));
        return 1;
    }
    for (i = 0; i < json_array_size(value); i++)
        count += put_numbers(json_array_get(value, i));
    return count;
}

static void put_array(const char *name, const char *key, const json_t *modes)
{
    size_t i;

    printf("static const double %s_%s[] = {", name, key);
    for (i = 0; i < json_array_size(modes); i++)
        if (put_numbers(json_object_get(json_array_get(modes, i), key)) == 0)
            printf("0,");
    printf("};\n");
}

/* The numbers of a CSV file behind its first column; rows. */
static int put_csv(const char *name, const char *what, const char *path)
{
    FILE *in = fopen(path, "r");
    static char line[65536];
    int rows = 0;

    if (in == NULL || fgets(line, sizeof line, in) == NULL)
        fail("cannot be read", path);
    printf("static const double %s_%s[] = {\n", name, what);
    while (fgets(line, sizeof line, in) != NULL) {
        char *p = strchr(line, ',');

        if (p == NULL)
            fail("a row without a comma", path);
        p[strcspn(p, "\r\n")] = '\0';
        printf("%s,\n", p + 1);
        rows++;
    }
    printf("};\n");
    fclose(in);
    return rows;
}

static void put_case(const char *dir, const char *name)
{
    static const char *const keys[] = { "Phi", "Gamma", "Q", "H", "R", "w_bar",
                                        "x0", "P0" };
    char path[4096];
    json_error_t error;
    json_t *model, *modes;
    size_t k;
    int rows;

    snprintf(path, sizeof path, "%s/%s/model.json", dir, name);
    model = json_load_file(path, 0, &error);
    if (model == NULL)
        fail(error.text, path);
    modes = json_object_get(model, "modes");
    for (k = 0; k < sizeof keys / sizeof *keys; k++)
        put_array(name, keys[k], modes);
    printf("static const double %s_Pi[] = {", name);
    put_numbers(json_object_get(model, "Pi"));
    printf("};\nstatic const double %s_mu0[] = {", name);
    put_numbers(json_object_get(model, "mu0"));
    printf("};\n");
    snprintf(path, sizeof path, "%s/%s/z.csv", dir, name);
    rows = put_csv(name, "z", path);
    snprintf(path, sizeof path, "%s/%s/expected.csv", dir, name);
    if (put_csv(name, "expected", path) != rows)
        fail("not as many rows as z.csv", path);
    printf("#define CASE_%s { \"%s\", %d, %d, %d, %d, %d, %s_Phi, %s_Gamma, "
           "%s_Q, %s_H, %s_R, %s_w_bar, %s_x0, %s_P0, %s_Pi, %s_mu0, %s_z, "
           "%s_expected }\n",
           name, name, (int)json_array_size(modes),
           (int)json_integer_value(json_object_get(model, "n")),
           (int)json_integer_value(json_object_get(model, "m")),
           (int)json_array_size(json_object_get(json_array_get(modes, 0), "Q")),
           rows, name, name, name, name, name, name, name, name, name, name,
           name, name);
    json_decref(model);
}

static int visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

int main(int argc, char **argv)
{
    struct dirent **names;
    int i, n;

    if (argc != 2)
        fail("usage: gen_golden DIR", "arguments");
    n = scandir(argv[1], &names, visible, alphasort);
    if (n < 1)
        fail("no cases", argv[1]);
    printf("/* made by gen_golden from tests/golden/imm */\n");
    for (i = 0; i < n; i++)
        put_case(argv[1], names[i]->d_name);
    printf("static const struct imm_case imm_cases[] = {\n");
    for (i = 0; i < n; i++)
        printf("    CASE_%s,\n", names[i]->d_name);
    printf("};\n");
    return 0;
}
