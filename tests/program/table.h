/* A CSV file of numbers, read without the program's own reader. */
#ifndef TESTS_TABLE_H
#define TESTS_TABLE_H

#include "close.h"

#include <stdlib.h>

struct table {
    char header[4096];
    int rows, columns;
    double *v;                  /* [rows,columns] */
};

static inline int table_count(const char *text, char c)
{
    int count = 0;

    while ((text = strchr(text, c)) != NULL) {
        count++;
        text++;
    }
    return count;
}

static inline void table_take(struct table *t, const char *text)
{
    size_t length = strcspn(text, "\n");
    int i, count;

    assert_true(length < sizeof t->header);
    memcpy(t->header, text, length);
    t->header[length] = '\0';
    t->columns = table_count(t->header, ',') + 1;
    t->rows = table_count(text, '\n') - 1;
    count = t->rows * t->columns;
    t->v = calloc((size_t)count + 1, sizeof *t->v);
    assert_non_null(t->v);
    text += length + 1;
    for (i = 0; i < count; i++) {
        char *end;

        t->v[i] = strtod(text, &end);
        assert_true(end > text);
        assert_int_equal(*end, (i + 1) % t->columns == 0 ? '\n' : ',');
        text = end + 1;
    }
    assert_int_equal(*text, '\0');
}

static inline void table_free(struct table *t)
{
    free(t->v);
    t->v = NULL;
}

static inline double table_at(const struct table *t, int row, int column)
{
    assert_true(row >= 0 && row < t->rows && column < t->columns);
    return t->v[row * t->columns + column];
}

#endif
