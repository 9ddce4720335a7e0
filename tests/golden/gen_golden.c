/* Turns the reference cases of a kind of filter into C tables, so that the same
 * test runs on a PC and on a board:  gen_golden DIR KIND > KIND_cases.h
 * DIR holds one folder a case: model.json, z.csv, and what is expected. */
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

/* What a case's struct holds behind its name: words; sizes, M before and p behind
 * them if there are modes; rows; numbers by mode, at the top, in params; tables. */
static const struct kind {
    const char *name;
    const char *words[3], *sizes[6], *modes[9], *top[7], *params[18];
    const char *tables[4];
} kinds[] = {
    { "imm", { NULL }, { "n", "m" },
      { "Phi", "Gamma", "Q", "H", "R", "w_bar", "x0", "P0" },
      { "Pi", "mu0" }, { NULL }, { "z", "expected" } },
    { "cgimm", { NULL }, { "n", "m" }, { "x0", "w0", "winf", "kc" },
      { "T", "R", "Pi", "mu0" }, { NULL }, { "z", "expected" } },
    { "mekf", { "model", "cb" }, { "n", "m", "r", "p1", "p2" }, { NULL },
      { "x0", "y0", "P0", "P10", "Q", "R" },
      { "T", "d", "C", "A0", "A1", "A2", "C0", "C1", "C2", "B1", "B2", "B3",
        "a1", "a2", "b1", "b2", "g" },
      { "z", "expected", "expected_ekf" } }
};

static const struct kind *kind_of(const char *name)
{
    size_t i;

    for (i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i].name, name) == 0)
            return &kinds[i];
    fail("no such kind", name);
    return NULL;
}

/* The numbers of each key of a JSON object, a 0 for what is not there. */
static void put_keys(const char *name, const char *const *key,
                     const json_t *object)
{
    for (; *key != NULL; key++) {
        printf("static const double %s_%s[] = {", name, *key);
        if (put_numbers(json_object_get(object, *key)) == 0)
            printf("0,");
        printf("};\n");
    }
}

static void put_names(const char *name, const char *const *key)
{
    for (; *key != NULL; key++)
        printf("%s_%s, ", name, *key);
}

/* All tables of a case; how many rows each has. */
static int put_tables(const char *name, const char *const *table,
                      const char *folder)
{
    char path[4096];
    int i, rows = 0;

    for (i = 0; table[i] != NULL; i++) {
        int here;

        snprintf(path, sizeof path, "%s/%s.csv", folder, table[i]);
        here = put_csv(name, table[i], path);
        if (i > 0 && here != rows)
            fail("not as many rows as z.csv", path);
        rows = here;
    }
    return rows;
}

static void put_case(const struct kind *kind, const char *dir, const char *name)
{
    char folder[2048], path[4096];
    json_error_t error;
    json_t *model, *modes;
    const char *const *key;
    int rows;

    snprintf(folder, sizeof folder, "%s/%s", dir, name);
    snprintf(path, sizeof path, "%s/model.json", folder);
    model = json_load_file(path, 0, &error);
    if (model == NULL)
        fail(error.text, path);
    modes = json_object_get(model, "modes");
    for (key = kind->modes; *key != NULL; key++)
        put_array(name, *key, modes);
    put_keys(name, kind->top, model);
    put_keys(name, kind->params, json_object_get(model, "params"));
    rows = put_tables(name, kind->tables, folder);
    printf("#define CASE_%s { \"%s\", ", name, name);
    for (key = kind->words; *key != NULL; key++)
        printf("\"%s\", ", json_string_value(json_object_get(model, *key)));
    if (modes != NULL)
        printf("%d, ", (int)json_array_size(modes));
    for (key = kind->sizes; *key != NULL; key++)
        printf("%d, ", (int)json_integer_value(json_object_get(model, *key)));
    if (modes != NULL)
        printf("%d, ", (int)json_array_size(json_object_get(
            json_array_get(modes, 0), "Q")));
    printf("%d, ", rows);
    put_names(name, kind->modes);
    put_names(name, kind->top);
    put_names(name, kind->params);
    put_names(name, kind->tables);
    printf("}\n");
    json_decref(model);
}

static int visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

int main(int argc, char **argv)
{
    const struct kind *kind;
    struct dirent **names;
    int i, n;

    if (argc != 3)
        fail("usage: gen_golden DIR KIND", "arguments");
    kind = kind_of(argv[2]);
    n = scandir(argv[1], &names, visible, alphasort);
    if (n < 1)
        fail("no cases", argv[1]);
    printf("/* made by gen_golden from tests/golden/%s */\n", kind->name);
    for (i = 0; i < n; i++)
        put_case(kind, argv[1], names[i]->d_name);
    printf("static const struct %s_case %s_cases[] = {\n", kind->name,
           kind->name);
    for (i = 0; i < n; i++)
        printf("    CASE_%s,\n", names[i]->d_name);
    printf("};\n");
    return 0;
}
