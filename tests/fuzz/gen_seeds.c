/* gen_seeds FOLDER <CORPUS.hex: each input of a corpus as a file, as libFuzzer
 * wants them. */
#include "fuzz.h"

int main(int argc, char **argv)
{
    static unsigned char octets[4096];
    char path[400];
    int i, n;

    if (argc != 2)
        return 2;
    for (i = 0; (n = fuzz_read(stdin, octets, sizeof octets)) >= 0; i++) {
        FILE *stream;

        snprintf(path, sizeof path, "%s/%03d", argv[1], i);
        stream = fopen(path, "wb");
        if (stream == NULL || fwrite(octets, 1, (size_t)n, stream) != (size_t)n
            || fclose(stream) != 0) {
            perror(path);
            return 1;
        }
    }
    if (n == -2)
        fprintf(stderr, "gen_seeds: input %d is not hexadecimal, or too long\n",
                i);
    return n == -1 ? 0 : 1;
}
