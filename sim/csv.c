#include "csv.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"

/* Read a line without its end into csv->text.  As csv_row. */
static int line_read(struct csv *csv)
{
    ssize_t length;

    errno = 0;
    length = getline(&csv->text, &csv->size, csv->stream);
    if (length < 0) {
        if (feof(csv->stream) && !ferror(csv->stream))
            return 0;
        return complain(csv->path, 0, NULL, "cannot read: %s",
                        strerror(errno));
    }
    csv->line++;
    if (strlen(csv->text) != (size_t)length)
        return complain(csv->path, csv->line, NULL,
                        "not a text file (it has zero octets)");
    if (length > 0 && csv->text[length - 1] == '\n')
        csv->text[--length] = '\0';
    if (length > 0 && csv->text[length - 1] == '\r')
        csv->text[--length] = '\0';
    return 1;
}

static int is_blank(const char *text)
{
    return text[strspn(text, " \t")] == '\0';
}

/* Undo the quotes of a field that begins with one, in place; return what is
 * behind the closing quote. */
static char *unquote(char *field)
{
    char *from = field + 1, *to = field;

    while (*from != '\0') {
        if (*from == '"' && *++from != '"')
            break;
        *to++ = *from++;
    }
    *to = '\0';
    return from;
}

static void trim_end(char *text)
{
    size_t n = strlen(text);

    while (n > 0 && (text[n - 1] == ' ' || text[n - 1] == '\t'))
        text[--n] = '\0';
}

/* Cut text at its commas into at most max fields; return how many there are. */
static int split(char *text, char **field, int max)
{
    int n = 0, last;

    do {
        char *start = text + strspn(text, " \t");
        int quoted = *start == '"';

        text = quoted ? unquote(start) : start;
        text += strcspn(text, ",");
        last = *text == '\0';
        *text++ = '\0';
        if (!quoted)
            trim_end(start);
        if (n < max)
            field[n] = start;
        n++;
    } while (!last);
    return n;
}

static int count_commas(const char *text)
{
    int n = 0;

    for (; *text != '\0'; text++)
        n += *text == ',';
    return n;
}

static int header_read(struct csv *csv)
{
    int i, j, most, got = line_read(csv);

    if (got <= 0)
        return got < 0 ? -1 : complain(csv->path, 0, NULL, "empty file");
    if (strncmp(csv->text, "\xEF\xBB\xBF", 3) == 0)
        memmove(csv->text, csv->text + 3, strlen(csv->text + 3) + 1);
    if (is_blank(csv->text))
        return complain(csv->path, 1, NULL, "blank line instead of a header");

    most = count_commas(csv->text) + 1;
    csv->header = strdup(csv->text);
    csv->name = calloc((size_t)most, sizeof *csv->name);
    csv->field = calloc((size_t)most, sizeof *csv->field);
    if (csv->header == NULL || csv->name == NULL || csv->field == NULL)
        return complain(csv->path, 0, NULL, "out of memory");
    csv->columns = split(csv->header, csv->name, most);
    for (i = 0; i < csv->columns; i++)
        for (j = 0; j < i; j++)
            if (strcmp(csv->name[i], csv->name[j]) == 0)
                return complain(csv->path, 1, csv->name[i],
                                "this column is there twice");
    return 0;
}

int csv_open(struct csv *csv, const char *path)
{
    memset(csv, 0, sizeof *csv);
    csv->path = path;
    csv->stream = fopen(path, "r");
    if (csv->stream == NULL)
        return complain(path, 0, NULL, "cannot open: %s", strerror(errno));
    if (header_read(csv) == 0)
        return 0;
    csv_close(csv);
    return -1;
}

/* Blank lines may only be followed by more of them. */
static int only_blank_left(struct csv *csv)
{
    long blank = csv->line;
    int got;

    while ((got = line_read(csv)) > 0)
        if (!is_blank(csv->text))
            return complain(csv->path, blank, NULL,
                            "blank line between rows");
    return got;
}

int csv_row(struct csv *csv)
{
    int n, got = line_read(csv);

    if (got <= 0)
        return got;
    if (is_blank(csv->text))
        return only_blank_left(csv);
    n = split(csv->text, csv->field, csv->columns);
    if (n < csv->columns)
        return complain(csv->path, csv->line, csv->name[n],
                        "missing: the row has %d fields, the header %d", n,
                        csv->columns);
    if (n > csv->columns)
        return complain(csv->path, csv->line, csv->name[csv->columns - 1],
                        "more behind this last column: the row has %d fields, "
                        "the header %d", n, csv->columns);
    return 1;
}

int csv_find(const struct csv *csv, const char *name)
{
    int i;

    for (i = 0; i < csv->columns; i++)
        if (strcmp(csv->name[i], name) == 0)
            return i;
    return -1;
}

void csv_close(struct csv *csv)
{
    if (csv->stream != NULL)
        fclose(csv->stream);
    free(csv->name);
    free(csv->field);
    free(csv->header);
    free(csv->text);
    memset(csv, 0, sizeof *csv);
}
