/* A process on the network of a run that does not belong to it: it sends what
 * a run must refuse, or what it has recorded. */
#ifndef TESTS_STRANGER_H
#define TESTS_STRANGER_H

#include "scratch.h"

#include <arpa/inet.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <lcm/lcm.h>

#include "jumplink/wire.h"

#define STRANGER_GROUP "239.255.76.67"
#define STRANGER_PORT 7667
#define STRANGER_URL "udpm://239.255.76.67:7667?ttl=0"
#define STRANGER_LONGEST 65536

/* --- processes ----------------------------------------------------------- */

/* A child that ends with the test, and in any case after a while.  Returns 0
 * in the child. */
static inline pid_t stranger_begin(void)
{
    pid_t parent = getpid(), child;

    fflush(NULL);
    child = fork();
    scratch_must(child >= 0, "fork");
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent)
            _exit(99);
        alarm(100);
    }
    return child;
}

/* It is still at work, and is ended. */
static inline void stranger_end(pid_t child)
{
    int status = 0;

    assert_int_equal(kill(child, SIGTERM), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    if (!WIFSIGNALED(status) || WTERMSIG(status) != SIGTERM)
        print_error("the stranger did not last: status %d\n", status);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
}

/* --- the network --------------------------------------------------------- */

static inline struct sockaddr_in stranger_address(void)
{
    struct sockaddr_in address;

    memset(&address, 0, sizeof address);
    address.sin_family = AF_INET;
    address.sin_port = htons(STRANGER_PORT);
    inet_pton(AF_INET, STRANGER_GROUP, &address.sin_addr);
    return address;
}

/* A socket that hears what LCM hears. */
static inline int stranger_listen(void)
{
    struct sockaddr_in address = stranger_address();
    int one = 1, size = 4 << 20, sock = socket(AF_INET, SOCK_DGRAM, 0);
    struct ip_mreq group;

    memset(&group, 0, sizeof group);
    group.imr_multiaddr = address.sin_addr;
    group.imr_interface.s_addr = htonl(INADDR_ANY);
    scratch_must(sock >= 0, "socket");
    setsockopt(sock, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
    setsockopt(sock, SOL_SOCKET, SO_REUSEPORT, &one, sizeof one);
    setsockopt(sock, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size);
    scratch_must(bind(sock, (struct sockaddr *)&address, sizeof address) == 0,
                 "bind");
    scratch_must(setsockopt(sock, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group,
                            sizeof group) == 0, "multicast group");
    return sock;
}

static inline void stranger_send(int sock, const void *octets, size_t len)
{
    struct sockaddr_in address = stranger_address();

    (void)sendto(sock, octets, len, 0, (struct sockaddr *)&address,
                 sizeof address);
}

/* --- hostile ------------------------------------------------------------- */

struct stranger {
    lcm_t *lcm;
    int ear, mouth;
    char run[20];
    int nodes;
    unsigned noise;
    unsigned char frame[JL_FRAME_MAX];  /* a real one, when one was heard   */
    int len;
    unsigned char octets[STRANGER_LONGEST];
};

static inline unsigned stranger_dice(struct stranger *s, unsigned n)
{
    s->noise = s->noise * 1664525u + 1013904223u;
    return (s->noise >> 8) % n;
}

static inline void stranger_noise(struct stranger *s, int from, int len)
{
    int i;

    for (i = from; i < from + len; i++)
        s->octets[i] = (unsigned char)stranger_dice(s, 256);
}

/* To a node of the run. */
static inline void stranger_publish(struct stranger *s, int len)
{
    char channel[40];

    snprintf(channel, sizeof channel, "JL.%s.%u", s->run,
             stranger_dice(s, (unsigned)s->nodes));
    lcm_publish(s->lcm, channel, s->octets, (unsigned)len);
}

/* The newest frame of the run: after LCM's header (magic, number) and the name
 * of the channel. */
static inline void stranger_hear(struct stranger *s)
{
    static unsigned char heard[STRANGER_LONGEST];
    char name[40];
    ssize_t n;
    int skip;

    snprintf(name, sizeof name, "JL.%s.", s->run);
    while ((n = recv(s->ear, heard, sizeof heard, MSG_DONTWAIT)) > 0) {
        if (n < 12 || memcmp(heard, "LC02", 4) != 0
            || strncmp((char *)heard + 8, name, strlen(name)) != 0)
            continue;
        skip = 8 + (int)strnlen((char *)heard + 8, (size_t)n - 8) + 1;
        if (n - skip < JL_FRAME_HEADER + JL_FRAME_TRAILER
            || n - skip > JL_FRAME_MAX || heard[skip] != 0x4a)
            continue;
        s->len = (int)n - skip;
        memcpy(s->frame, heard + skip, (size_t)s->len);
    }
}

/* A real frame into octets, or, before one was heard, one that might be. */
static inline int stranger_frame(struct stranger *s)
{
    jl_frame f;

    if (s->len > 0) {
        memcpy(s->octets, s->frame, (size_t)s->len);
        return s->len;
    }
    memset(&f, 0, sizeof f);
    f.kind = 1 + (int)stranger_dice(s, 7);
    f.number = JL_REAL_OCTETS;
    f.from = (int)stranger_dice(s, (unsigned)s->nodes);
    f.to = (int)stranger_dice(s, (unsigned)s->nodes);
    f.session = 1 + stranger_dice(s, 1000000);
    return jl_frame_encode(s->octets, JL_FRAME_MAX, &f);
}

/* ... that says to be one of the next: what was heard has been taken. */
static inline int stranger_next_frame(struct stranger *s)
{
    int len = stranger_frame(s);

    jl_put_u32(s->octets + 16, jl_get_u32(s->octets + 16) + 1
               + stranger_dice(s, 3));
    return len;
}

static inline void stranger_seal(struct stranger *s, int len)
{
    int end = len - JL_FRAME_TRAILER;

    jl_put_u32(s->octets + end, jl_crc32(0, s->octets, end));
}

/* The right checksum, and a wrong session, kind, sender, receiver or type of
 * number.  It does not know the receiver's session: who does can say anything
 * in a run's name. */
static inline void stranger_forge(struct stranger *s)
{
    int len = stranger_next_frame(s);

    jl_put_u32(s->octets + 12, 1 + stranger_dice(s, 1u << 24));
    switch (stranger_dice(s, 6)) {
    case 0: jl_put_u32(s->octets + 8, 1 + stranger_dice(s, 1u << 24)); break;
    case 1: s->octets[3] = (unsigned char)stranger_dice(s, 256); break;
    case 2: s->octets[4] ^= 12; break;
    case 3: s->octets[5] = (unsigned char)stranger_dice(s, 256); break;
    case 4: s->octets[6] = (unsigned char)stranger_dice(s, 256); break;
    case 5: s->octets[7 + stranger_dice(s, 25)] ^= 1; break;
    }
    stranger_seal(s, len);
    stranger_publish(s, len);
}

/* LCM's own form, wrong: cut short, a channel's name without an end, pieces of
 * long messages that never come or that lie about their place. */
static inline void stranger_break_lcm(struct stranger *s)
{
    int len = 20 + (int)stranger_dice(s, 1200);

    stranger_noise(s, 0, len);
    switch (stranger_dice(s, 4)) {
    case 0:
        break;
    case 1:
        memcpy(s->octets, "LC02", 4);
        len = (int)stranger_dice(s, 12);
        break;
    case 2:
        memcpy(s->octets, "LC02", 4);
        memset(s->octets + 8, 'J', (size_t)len - 8);
        break;
    case 3:                     /* 8: size, 12: place, 16: piece of pieces */
        memcpy(s->octets, "LC03", 4);
        memset(s->octets + 8, 0, 12);
        s->octets[10] = s->octets[14] = (unsigned char)stranger_dice(s, 256);
        s->octets[17] = (unsigned char)stranger_dice(s, 4);
        s->octets[19] = (unsigned char)stranger_dice(s, 4);
        break;
    }
    stranger_send(s->mouth, s->octets, (size_t)len);
}

static inline void stranger_act(struct stranger *s)
{
    static const char *const channels[] = { "POSE", "JL.", "JL.other.0", "",
        "a channel's name with spaces and some sixty letters, no more" };
    int len;

    switch (stranger_dice(s, 8)) {
    case 0:                     /* foreign messages */
        len = (int)stranger_dice(s, 1400);
        stranger_noise(s, 0, len);
        lcm_publish(s->lcm, channels[stranger_dice(s, 5)], s->octets,
                    (unsigned)len);
        break;
    case 1:                     /* no frames at all */
        len = (int)stranger_dice(s, 1400);
        stranger_noise(s, 0, len);
        stranger_publish(s, len);
        break;
    case 2:                     /* cut short */
        len = (int)stranger_dice(s, (unsigned)stranger_frame(s));
        stranger_publish(s, len);
        break;
    case 3:                     /* the right header, another length */
        len = stranger_frame(s);
        jl_put_u16(s->octets + 24, stranger_dice(s, 65536));
        if (stranger_dice(s, 2))
            stranger_seal(s, len);
        stranger_publish(s, len);
        break;
    case 4:                     /* damaged */
        len = stranger_next_frame(s);
        s->octets[stranger_dice(s, (unsigned)len)] ^=
            (unsigned char)(1 + stranger_dice(s, 255));
        stranger_publish(s, len);
        break;
    case 5:                     /* too long; LCM cuts the longest up */
        len = stranger_frame(s);
        memset(s->octets + len, 0, 60000);
        stranger_publish(s, len + (stranger_dice(s, 16) > 0 ? 1 : 60000));
        break;
    case 6: stranger_forge(s); break;
    case 7: stranger_break_lcm(s); break;
    }
}

/* Be hostile to the first `nodes` nodes of a run; returns when the first words
 * are said, and goes on until stranger_end. */
static inline pid_t stranger_start(const char *run, int nodes)
{
    static struct stranger s;
    int ready[2], i;
    pid_t child;
    char word;

    scratch_must(pipe(ready) == 0, "pipe");
    child = stranger_begin();
    if (child == 0) {
        memset(&s, 0, sizeof s);
        s.noise = 1;
        s.nodes = nodes;
        snprintf(s.run, sizeof s.run, "%s", run);
        s.ear = stranger_listen();
        s.mouth = socket(AF_INET, SOCK_DGRAM, 0);
        s.lcm = lcm_create(STRANGER_URL);
        scratch_must(s.mouth >= 0 && s.lcm != NULL, "network");
        for (i = 0;; i++) {
            stranger_hear(&s);
            stranger_act(&s);
            if (i == 100)
                scratch_must(write(ready[1], "", 1) == 1, "pipe");
            if (i % 8 == 7)
                poll(NULL, 0, 1);
        }
    }
    close(ready[1]);
    scratch_must(read(ready[0], &word, 1) == 1, "the stranger");
    close(ready[0]);
    return child;
}

/* --- records ------------------------------------------------------------- */

/* Keep all datagrams in a file, each after its length. */
static inline pid_t stranger_record(const char *path)
{
    static unsigned char octets[STRANGER_LONGEST];
    int ear = stranger_listen();
    pid_t child = stranger_begin();

    if (child == 0) {
        int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);

        scratch_must(fd >= 0, path);
        for (;;) {
            ssize_t n = recv(ear, octets + 4, sizeof octets - 4, 0);

            scratch_must(n >= 0, "recv");
            jl_put_u32(octets, (jl_u32)n);
            scratch_must(write(fd, octets, (size_t)n + 4) == n + 4, path);
        }
    }
    close(ear);
    return child;
}

static inline void stranger_repeat(int fd, int mouth, const char *path)
{
    static unsigned char octets[STRANGER_LONGEST];
    ssize_t n;
    int i;

    for (i = 0;; i++) {
        if (read(fd, octets, 4) == 4) {
            n = (ssize_t)jl_get_u32(octets);
            scratch_must(n <= STRANGER_LONGEST
                         && read(fd, octets, (size_t)n) == n, path);
            stranger_send(mouth, octets, (size_t)n);
        } else {
            scratch_must(i > 0 && lseek(fd, 0, SEEK_SET) == 0, path);
        }
        if (i % 8 == 7)
            poll(NULL, 0, 1);
    }
}

/* Send a record again and again, without its timing. */
static inline pid_t stranger_replay(const char *path)
{
    int mouth = socket(AF_INET, SOCK_DGRAM, 0), fd = open(path, O_RDONLY);
    pid_t child;

    scratch_must(mouth >= 0 && fd >= 0, path);
    child = stranger_begin();
    if (child == 0)
        stranger_repeat(fd, mouth, path);
    close(mouth);
    close(fd);
    return child;
}

#endif
