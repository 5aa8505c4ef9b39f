/* A live link for games in C or C++: what the game asks and picks, for `contextdb live` on the same machine.
 *
 *   cdbl_open        listens on a Unix socket that only programs of the same user can connect to
 *   cdbl_listeners   once a frame: takes connections, and says how many listen; while none does, tell nothing
 *   ..._tell         one function for each table, further down: sends one question, its valid rows and the pick
 *   cdbl_pose        sends a pose of a character
 *   cdbl_close       listens no more
 *
 * Nothing here ever waits, and nothing takes memory: what a listener does not read in time is lost, and it is told how many lines.
 * Every line that is told is sent, whatever a listener asks for. One thread at a time may use a link. The lines are those of
 * docs/live.md, format 1. On Windows there is no link in C: cdbl_open gives 0, and the rest does nothing.
 *
 * Include this file before all others, or compile with _GNU_SOURCE, where the compiler is asked for strict C (-std=c99).
 */

#ifndef CDBL_LINE
#define CDBL_LINE 16384     /* bytes of the longest line; one that would be longer is lost */
#endif
#ifndef CDBL_PENDING
#define CDBL_PENDING 65536  /* bytes that wait for a listener that does not read */
#endif
#define CDBL_LISTENERS 4    /* who connects when there are so many is sent away */
#define CDBL_GAMES 99

typedef struct cdbl_bones { /* of a character */
    const char *const *names;
    const int64_t *parents; /* each before those that it moves; -1: none */
    size_t n;
    uint64_t welcomed;      /* 0 at first: how many had come when they were sent last */
} cdbl_bones;

#ifdef _WIN32

typedef struct cdbl_link {
    char game[1];
    uint64_t lost;
} cdbl_link;

static inline int cdbl_open(cdbl_link *link, const char *game)
{
    (void)game;
    memset(link, 0, sizeof *link);
    return 0;
}

static inline int cdbl_listeners(cdbl_link *link)
{
    (void)link;
    return 0;
}

static inline void cdbl_pose(cdbl_link *link, const char *who, cdbl_bones *bones, const char *asset, const double *root,
    const double *rotations, const double *translations)
{
    (void)link, (void)who, (void)bones, (void)asset, (void)root, (void)rotations, (void)translations;
}

static inline void cdbl_close(cdbl_link *link)
{
    (void)link;
}

#else

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#ifndef MSG_NOSIGNAL
#define MSG_NOSIGNAL 0      /* macOS: SO_NOSIGPIPE is set instead */
#endif

typedef struct cdbl_listener {
    int socket;             /* -1: nobody */
    size_t n_pending;
    uint64_t lost;          /* lines since it was last told */
    char pending[CDBL_PENDING];
} cdbl_listener;

typedef struct cdbl_link {
    int server;             /* -1: closed */
    ino_t inode;
    double began;
    char game[64];
    char folder[128];
    char path[108];
    uint64_t lost;          /* lines that did not fit into CDBL_LINE */
    uint64_t welcomed;      /* how many have come to listen */
    size_t used;
    int is_long;
    char line[CDBL_LINE];
    cdbl_listener listeners[CDBL_LISTENERS];
} cdbl_link;

static inline void cdbl_tables(cdbl_link *link); /* what the header of the lines says of the tables: see further down */

/* ---- writing a line */

static inline void cdbl_put(cdbl_link *link, const char *text, size_t size)
{
    if (size > sizeof link->line - link->used) {
        link->is_long = 1;
        return;
    }
    memcpy(link->line + link->used, text, size);
    link->used += size;
}

static inline void cdbl_say(cdbl_link *link, const char *text)
{
    cdbl_put(link, text, strlen(text));
}

/* How many bytes the character of UTF-8 has that begins here; 0 for none. */
static inline size_t cdbl_character(const unsigned char *text)
{
    size_t size = text[0] < 0x80 ? 1 : text[0] < 0xC2 ? 0 : text[0] < 0xE0 ? 2 : text[0] < 0xF0 ? 3 : text[0] < 0xF5 ? 4 : 0;
    size_t i;
    for (i = 1; i < size; i++)
        if ((text[i] & 0xC0) != 0x80) return 0;
    if (size == 3 && ((text[0] == 0xE0 && text[1] < 0xA0) || (text[0] == 0xED && text[1] > 0x9F))) return 0;
    if (size == 4 && ((text[0] == 0xF0 && text[1] < 0x90) || (text[0] == 0xF4 && text[1] > 0x8F))) return 0;
    return size;
}

/* A text of JSON; null for NULL, "?" for each byte that is not UTF-8. */
static inline void cdbl_text_of(cdbl_link *link, const char *text)
{
    const unsigned char *at = (const unsigned char *)text;
    char escape[8];
    if (text == NULL) {
        cdbl_say(link, "null");
        return;
    }
    cdbl_put(link, "\"", 1);
    while (*at != 0 && !link->is_long) {
        size_t size = cdbl_character(at);
        if (*at < 0x20 || *at == '"' || *at == '\\' || *at == 0x7F) {
            snprintf(escape, sizeof escape, "\\u%04x", (unsigned)*at);
            cdbl_say(link, escape);
        } else {
            cdbl_put(link, size == 0 ? "?" : (const char *)at, size == 0 ? 1 : size);
        }
        at += size == 0 ? 1 : size;
    }
    cdbl_put(link, "\"", 1);
}

static inline void cdbl_double(cdbl_link *link, double number)
{
    char text[40], *comma;
    if (number != number) {
        cdbl_say(link, "null");
    } else if (number - number != 0.0) {
        cdbl_say(link, number > 0.0 ? "{\"number\":\"inf\"}" : "{\"number\":\"-inf\"}");
    } else {
        snprintf(text, sizeof text, "%.17g", number);
        if ((comma = strchr(text, ',')) != NULL) *comma = '.'; /* as some locales write it */
        cdbl_say(link, text);
    }
}

static inline void cdbl_int(cdbl_link *link, int64_t number)
{
    char text[24];
    snprintf(text, sizeof text, "%lld", (long long)number);
    cdbl_say(link, text);
}

/* The name of a fact, with a comma before it but for the first. */
static inline void cdbl_name(cdbl_link *link, const char *name)
{
    if (link->used > 0 && link->used < sizeof link->line && link->line[link->used - 1] != '{') cdbl_put(link, ",", 1);
    cdbl_text_of(link, name);
    cdbl_put(link, ":", 1);
}

static inline void cdbl_truth(cdbl_link *link, const char *name, int truth)
{
    cdbl_name(link, name);
    cdbl_say(link, truth == CDB_MISSING ? "null" : truth ? "true" : "false");
}

static inline void cdbl_whole(cdbl_link *link, const char *name, int64_t number)
{
    cdbl_name(link, name);
    if (number == CDB_MISSING_INT) cdbl_say(link, "null");
    else cdbl_int(link, number);
}

static inline void cdbl_number(cdbl_link *link, const char *name, double number)
{
    cdbl_name(link, name);
    cdbl_double(link, number);
}

/* Days since 1970-01-01 as a date of the calendar. */
static inline void cdbl_date(cdbl_link *link, const char *name, int64_t days)
{
    char text[40];
    int64_t z = days + 719468, era = (z >= 0 ? z : z - 146096) / 146097, day = z - era * 146097;
    int64_t of_era = (day - day / 1460 + day / 36524 - day / 146096) / 365, of_year, month;
    cdbl_name(link, name);
    if (days < CDB_FIRST_DATE || days > CDB_LAST_DATE) {
        cdbl_say(link, "null");
        return;
    }
    of_year = day - (365 * of_era + of_era / 4 - of_era / 100);
    month = (5 * of_year + 2) / 153;
    snprintf(text, sizeof text, "\"%04d-%02d-%02d\"", (int)(of_era + era * 400 + (month >= 10)), (int)(month < 10 ? month + 3 : month - 9),
        (int)(of_year - (153 * month + 2) / 5 + 1));
    cdbl_say(link, text);
}

static inline void cdbl_text(cdbl_link *link, const char *name, const char *text)
{
    cdbl_name(link, name);
    cdbl_text_of(link, text);
}

static inline void cdbl_choice(cdbl_link *link, const char *name, int64_t value, const char *const *values, int64_t n_values)
{
    cdbl_text(link, name, value >= 0 && value < n_values ? values[value] : NULL);
}

/* A set of declared tags: bit 0 says that it is known. */
static inline void cdbl_set(cdbl_link *link, const char *name, const uint64_t *words, const char *const *values, size_t n_values)
{
    size_t i;
    cdbl_name(link, name);
    if ((words[0] & 1) == 0) {
        cdbl_say(link, "null");
        return;
    }
    cdbl_put(link, "[", 1);
    for (i = 1; i < n_values; i++)
        if (words[i / 64] >> (i % 64) & 1) {
            if (link->line[link->used - 1] != '[') cdbl_put(link, ",", 1);
            cdbl_text_of(link, values[i]);
        }
    cdbl_put(link, "]", 1);
}

static inline void cdbl_texts(cdbl_link *link, const char *name, const cdb_texts *texts)
{
    int64_t i;
    cdbl_name(link, name);
    if (texts->count < 0) {
        cdbl_say(link, "null");
        return;
    }
    cdbl_put(link, "[", 1);
    for (i = 0; i < texts->count; i++) {
        if (i > 0) cdbl_put(link, ",", 1);
        cdbl_text_of(link, texts->texts[i]);
    }
    cdbl_put(link, "]", 1);
}

/* ---- sending lines */

static inline double cdbl_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static inline void cdbl_hang_up(cdbl_listener *listener)
{
    if (listener->socket >= 0) close(listener->socket);
    listener->socket = -1;
    listener->n_pending = 0;
    listener->lost = 0;
}

/* Send what waits, as much as the system takes now. */
static inline void cdbl_push(cdbl_listener *listener)
{
    while (listener->socket >= 0 && listener->n_pending > 0) {
        ssize_t sent = send(listener->socket, listener->pending, listener->n_pending, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
        if (sent <= 0) {
            cdbl_hang_up(listener);
            return;
        }
        listener->n_pending -= (size_t)sent;
        memmove(listener->pending, listener->pending + sent, listener->n_pending);
    }
}

static inline int cdbl_queue(cdbl_listener *listener, const char *line, size_t size)
{
    if (size > sizeof listener->pending - listener->n_pending) return 0;
    memcpy(listener->pending + listener->n_pending, line, size);
    listener->n_pending += size;
    return 1;
}

static inline void cdbl_offer(cdbl_listener *listener, const char *line, size_t size)
{
    char told[80];
    if (listener->socket < 0) return;
    cdbl_push(listener);
    if (listener->lost > 0 && listener->n_pending == 0) {
        snprintf(told, sizeof told, "{\"line\":\"lost\",\"count\":%llu}\n", (unsigned long long)listener->lost);
        if (cdbl_queue(listener, told, strlen(told))) listener->lost = 0;
    }
    if (!cdbl_queue(listener, line, size)) listener->lost++;
    cdbl_push(listener);
}

/* A number with some digits behind the point; 0 for what is no number. */
static inline void cdbl_rounded(cdbl_link *link, double number, int n_digits)
{
    char text[400], *comma;
    snprintf(text, sizeof text, "%.*f", n_digits, number - number == 0.0 ? number : 0.0);
    if ((comma = strchr(text, ',')) != NULL) *comma = '.';
    cdbl_say(link, text);
}

/* Begin a line: what it is, when, and who. */
static inline void cdbl_begin_line(cdbl_link *link, const char *what, const char *who)
{
    link->used = 0;
    link->is_long = 0;
    cdbl_say(link, "{\"line\":\"");
    cdbl_say(link, what);
    cdbl_say(link, "\",\"t\":");
    cdbl_rounded(link, cdbl_now() - link->began, 6);
    cdbl_say(link, ",\"who\":");
    cdbl_text_of(link, who);
}

/* End a line, and send it. */
static inline void cdbl_send(cdbl_link *link)
{
    size_t i;
    cdbl_say(link, "}\n");
    if (link->is_long) link->lost++;
    for (i = 0; i < CDBL_LISTENERS; i++) {
        if (link->is_long) link->listeners[i].lost += link->listeners[i].socket >= 0;
        else cdbl_offer(&link->listeners[i], link->line, link->used);
    }
}

/* Begin a line about a table. */
static inline void cdbl_begin(cdbl_link *link, const char *who, const char *table)
{
    cdbl_begin_line(link, "ask", who);
    cdbl_say(link, ",\"table\":");
    cdbl_text_of(link, table);
    cdbl_say(link, ",\"facts\":{");
}

/* End a line with the valid rows and the pick, and send it. */
static inline void cdbl_end(cdbl_link *link, const cdb_table *table, const uint64_t *rows, int64_t picked)
{
    size_t n_words = (size_t)((table->n_rows + 63) / 64), i;
    char text[64];
    cdbl_say(link, "},\"rows\":\"");
    for (i = n_words; i > 1 && rows[i - 1] == 0; i--) continue;
    snprintf(text, sizeof text, "%llx", (unsigned long long)(n_words > 0 ? rows[i - 1] : 0));
    cdbl_say(link, text);
    while (n_words > 0 && --i > 0) {
        snprintf(text, sizeof text, "%016llx", (unsigned long long)rows[i - 1]);
        cdbl_say(link, text);
    }
    snprintf(text, sizeof text, "\",\"valid\":%lld", (long long)cdb_count(rows, n_words));
    cdbl_say(link, text);
    if (picked >= 0) {
        snprintf(text, sizeof text, ",\"pick\":{\"row\":%lld,\"asset\":", (long long)picked);
        cdbl_say(link, text);
        cdbl_text_of(link, cdb_asset(table, picked));
        cdbl_say(link, "}");
    }
    cdbl_send(link);
}

/* A list of so many rows of numbers; all 0 where there are none. */
static inline void cdbl_rows(cdbl_link *link, const char *name, const double *numbers, size_t n, size_t width)
{
    size_t i;
    cdbl_say(link, ",\"");
    cdbl_say(link, name);
    cdbl_say(link, "\":[");
    for (i = 0; i < n * width; i++) {
        cdbl_say(link, i == 0 ? width > 1 ? "[" : "" : i % width == 0 ? width > 1 ? "],[" : "," : ",");
        cdbl_rounded(link, numbers ? numbers[i] : 0.0, 5);
    }
    cdbl_say(link, n > 0 && width > 1 ? "]]" : "]");
}

/* Send a pose: the asset that plays, or NULL; the root's x, z and heading; of each joint its turn against its parent, w, x, y, z, and its
 * place, x, y, z. The bones go before it where somebody has come to listen since. */
static inline void cdbl_pose(cdbl_link *link, const char *who, cdbl_bones *bones, const char *asset, const double *root,
    const double *rotations, const double *translations)
{
    size_t i, list;
    if (bones->welcomed != link->welcomed) {
        cdbl_begin_line(link, "bones", who);
        for (list = 0; list < 3; list++) {
            cdbl_say(link, list == 0 ? ",\"names\":[" : list == 1 ? ",\"parents\":[" : ",\"moving\":[");
            for (i = 0; i < bones->n; i++) {
                if (i > 0) cdbl_say(link, ",");
                if (list == 0) cdbl_text_of(link, bones->names[i]);
                else cdbl_int(link, list == 1 ? bones->parents[i] : (int64_t)i);
            }
            cdbl_say(link, "]");
        }
        cdbl_rows(link, "offsets", NULL, bones->n, 3);
        cdbl_send(link);
        bones->welcomed = link->welcomed;
    }
    cdbl_begin_line(link, "pose", who);
    cdbl_say(link, ",\"asset\":");
    cdbl_text_of(link, asset);
    cdbl_rows(link, "root", root, 3, 1);
    cdbl_rows(link, "rotations", rotations, bones->n, 4);
    cdbl_rows(link, "translations", translations, bones->n, 3);
    cdbl_send(link);
}

/* ---- who listens */

static inline int cdbl_is_own(const char *folder)
{
    struct stat found;
    return lstat(folder, &found) == 0 && S_ISDIR(found.st_mode) && found.st_uid == getuid() && (found.st_mode & 077) == 0;
}

/* The folder in which games are met, made where it is missing; 0 where it is not this user's alone. */
static inline int cdbl_folder(char *folder, size_t size)
{
    const char *given = getenv("XDG_RUNTIME_DIR"), *names[3] = {"TMPDIR", "TEMP", "TMP"}, *temporary = NULL;
    struct stat found;
    int n, i;
    if (given != NULL && given[0] == '/' && stat(given, &found) == 0 && S_ISDIR(found.st_mode) && found.st_uid == getuid()
        && (found.st_mode & 022) == 0) {
        n = snprintf(folder, size, "%s/contextdb", given);
    } else {
        for (i = 0; i < 3 && (temporary == NULL || temporary[0] == 0); i++) temporary = getenv(names[i]);
        n = snprintf(folder, size, "%s/contextdb-%lu", temporary == NULL || temporary[0] == 0 ? "/tmp" : temporary, (unsigned long)getuid());
    }
    if (n < 0 || (size_t)n >= size) return 0;
    if (mkdir(folder, 0700) != 0 && errno != EEXIST) return 0;
    return cdbl_is_own(folder);
}

/* Whether the program at the other end is the same user's; 1 where the system does not say. */
static inline int cdbl_is_same_user(int connection)
{
#ifdef SO_PEERCRED
    struct {
        int process;
        unsigned int user, group;
    } peer;
    socklen_t size = sizeof peer;
    return getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.user == (unsigned int)getuid();
#else
    (void)connection;
    return 1;
#endif
}

/* Whether nobody listens there; what a game that was killed left there is deleted. */
static inline int cdbl_is_free(const struct sockaddr_un *address)
{
    struct stat found;
    int probe, is_free;
    if (lstat(address->sun_path, &found) != 0) return errno == ENOENT;
    if (!S_ISSOCK(found.st_mode) || found.st_uid != getuid()) return 0;
    if ((probe = socket(AF_UNIX, SOCK_STREAM, 0)) < 0) return 0;
    fcntl(probe, F_SETFL, O_NONBLOCK);
    is_free = connect(probe, (const struct sockaddr *)address, sizeof *address) != 0 && errno == ECONNREFUSED;
    close(probe);
    return is_free && unlink(address->sun_path) == 0;
}

static inline int cdbl_is_name(const char *game)
{
    size_t n = strlen(game), i;
    if (n == 0 || n > 40 || game[0] == '.' || game[0] == '_' || game[0] == '-' || game[n - 1] == '.') return 0;
    for (i = 0; i < n; i++) {
        char c = game[i];
        if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-')) return 0;
    }
    return 1;
}

/* Listen at the first free name: "game", "game-2". */
static inline int cdbl_bind(cdbl_link *link, const char *game)
{
    struct sockaddr_un address;
    struct stat found;
    int number, n;
    for (number = 1; number <= CDBL_GAMES; number++) {
        char ending[16] = "";
        if (number > 1) snprintf(ending, sizeof ending, "-%d", number);
        memset(&address, 0, sizeof address);
        address.sun_family = AF_UNIX;
        snprintf(link->game, sizeof link->game, "%s%s", game, ending);
        n = snprintf(address.sun_path, sizeof address.sun_path, "%s/%s.sock", link->folder, link->game);
        if (n < 0 || (size_t)n >= sizeof address.sun_path) return 0;
        if (!cdbl_is_free(&address)) continue;
        if ((link->server = socket(AF_UNIX, SOCK_STREAM, 0)) < 0) return 0;
        fcntl(link->server, F_SETFL, O_NONBLOCK);
        fcntl(link->server, F_SETFD, FD_CLOEXEC);
        if (bind(link->server, (const struct sockaddr *)&address, sizeof address) == 0
            && chmod(address.sun_path, 0600) == 0 && lstat(address.sun_path, &found) == 0 && listen(link->server, 16) == 0) {
            link->inode = found.st_ino;
            memcpy(link->path, address.sun_path, (size_t)n + 1);
            return 1;
        }
        close(link->server);
        link->server = -1;
        return 0;
    }
    return 0;
}

/* Listen for who wants to watch the game; 1, or 0 where that cannot be: the rest then does nothing. */
static inline int cdbl_open(cdbl_link *link, const char *game)
{
    int folder, is_open, i;
    memset(link, 0, sizeof *link);
    link->server = -1;
    for (i = 0; i < CDBL_LISTENERS; i++) link->listeners[i].socket = -1;
    if (!cdbl_is_name(game) || !cdbl_folder(link->folder, sizeof link->folder)) return 0;
    if ((folder = open(link->folder, O_RDONLY)) < 0) return 0;
    flock(folder, LOCK_EX);
    is_open = cdbl_bind(link, game);
    close(folder);
    link->began = cdbl_now();
    return is_open;
}

static inline void cdbl_welcome(cdbl_link *link, int connection)
{
    char head[256];
    size_t began;
    int i;
#ifdef SO_NOSIGPIPE
    int yes = 1;
    setsockopt(connection, SOL_SOCKET, SO_NOSIGPIPE, &yes, sizeof yes);
#endif
    fcntl(connection, F_SETFL, O_NONBLOCK);
    fcntl(connection, F_SETFD, FD_CLOEXEC);
    for (i = 0; i < CDBL_LISTENERS && link->listeners[i].socket >= 0; i++) continue;
    if (i == CDBL_LISTENERS || !cdbl_is_same_user(connection)) {
        close(connection);
        return;
    }
    link->listeners[i].socket = connection;
    link->listeners[i].n_pending = 0;
    link->listeners[i].lost = 0;
    link->welcomed++;
    snprintf(head, sizeof head, "{\"line\":\"header\",\"format\":1,\"game\":\"%s\",\"pid\":%ld,\"contextdb\":\"C\",\"began\":%lld,\"tables\":",
        link->game, (long)getpid(), (long long)time(NULL) - (long long)(cdbl_now() - link->began));
    link->used = 0;
    link->is_long = 0;
    cdbl_say(link, head);
    began = link->used;
    cdbl_tables(link);
    if (link->is_long || link->used + 2 > sizeof link->line) { /* too many tables for a line: none is named */
        link->used = began;
        link->is_long = 0;
        cdbl_say(link, "{}");
    }
    cdbl_say(link, "}\n");
    cdbl_offer(&link->listeners[i], link->line, link->used);
}

/* Take connections, and send what waits; how many listen. Call it once a frame. */
static inline int cdbl_listeners(cdbl_link *link)
{
    char passed_over[4096];
    int n = 0, i, connection;
    if (link->server < 0) return 0;
    for (i = 0; i < CDBL_LISTENERS && (connection = accept(link->server, NULL, NULL)) >= 0; i++) cdbl_welcome(link, connection);
    for (i = 0; i < CDBL_LISTENERS; i++) {
        cdbl_listener *listener = &link->listeners[i];
        ssize_t got;
        if (listener->socket < 0) continue;
        got = recv(listener->socket, passed_over, sizeof passed_over, MSG_DONTWAIT);
        if (got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) cdbl_hang_up(listener);
        else cdbl_push(listener);
        n += listener->socket >= 0;
    }
    return n;
}

/* Listen no more; those that listen are told. */
static inline void cdbl_close(cdbl_link *link)
{
    const char *end = "{\"line\":\"end\"}\n";
    struct stat found;
    int folder, i;
    if (link->server < 0) return;
    for (i = 0; i < CDBL_LISTENERS; i++) {
        cdbl_offer(&link->listeners[i], end, strlen(end));
        cdbl_hang_up(&link->listeners[i]);
    }
    close(link->server);
    link->server = -1;
    if ((folder = open(link->folder, O_RDONLY)) < 0) return;
    flock(folder, LOCK_EX);
    if (lstat(link->path, &found) == 0 && found.st_ino == link->inode) unlink(link->path);
    close(folder);
}

#endif
