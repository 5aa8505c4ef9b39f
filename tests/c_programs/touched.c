/* How many words of masks the core reads for some answers: "touched" after each, in the order of the arguments.
 * argv: the number of words of a mask, of masks, and the places of masks that leave no row. */
#include <stddef.h>

static size_t touched;
#define CDBI_TOUCH(n_words) (touched += (n_words))
#include "core.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    static uint64_t every[4096], none[4096], rows[4096];
    const uint64_t *masks[64];
    size_t n_words, n_masks, i;
    int at;
    if (argc < 3) return 2;
    n_words = (size_t)strtoul(argv[1], NULL, 10);
    n_masks = (size_t)strtoul(argv[2], NULL, 10);
    if (n_words > 4096 || n_masks > 64) return 2;
    for (i = 0; i < n_words; i++) every[i] = ~(uint64_t)0;
    for (i = 0; i < n_masks; i++) masks[i] = every;
    for (at = 3; at < argc; at++) masks[strtoul(argv[at], NULL, 10) % 64] = none;
    cdbi_and(rows, every, masks, n_masks, n_words);
    printf("%lu %lld\n", (unsigned long)touched, (long long)cdb_count(rows, n_words));
    return 0;
}
