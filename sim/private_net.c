#include "private_net.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

static int write_text(const char *path, const char *text)
{
    ssize_t len = (ssize_t)strlen(text), written;
    int fd = open(path, O_WRONLY | O_CLOEXEC);

    if (fd < 0)
        return -1;
    written = write(fd, text, (size_t)len);
    close(fd);
    return written == len ? 0 : -1;
}

/* Every id mapped to itself, so that files and messages look as before. */
static int map_ids(uid_t uid, gid_t gid)
{
    char text[64];

    /* The kernel demands this first of a user who gives up nothing by it. */
    if (write_text("/proc/self/setgroups", "deny") != 0 && errno != ENOENT)
        return -1;
    snprintf(text, sizeof text, "%lu %lu 1", (unsigned long)uid,
             (unsigned long)uid);
    if (write_text("/proc/self/uid_map", text) != 0)
        return -1;
    snprintf(text, sizeof text, "%lu %lu 1", (unsigned long)gid,
             (unsigned long)gid);
    return write_text("/proc/self/gid_map", text);
}

static int leave_the_old_net(void)
{
    uid_t uid = geteuid();
    gid_t gid = getegid();

    if (unshare(CLONE_NEWNET) == 0)
        return 0;
    if (errno != EPERM || unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0)
        return -1;
    return map_ids(uid, gid);
}

static int loopback_up(int sock)
{
    struct ifreq ifr;

    memset(&ifr, 0, sizeof ifr);
    strcpy(ifr.ifr_name, "lo");
    if (ioctl(sock, SIOCGIFFLAGS, &ifr) != 0)
        return -1;
    ifr.ifr_flags = (short)(ifr.ifr_flags | IFF_UP);
    return ioctl(sock, SIOCSIFFLAGS, &ifr);
}

static void set_address(struct sockaddr *address, const char *text)
{
    struct sockaddr_in in;

    memset(&in, 0, sizeof in);
    in.sin_family = AF_INET;
    inet_pton(AF_INET, text, &in.sin_addr);
    memcpy(address, &in, sizeof in);
}

static int multicast_route(int sock)
{
    char device[] = "lo";
    struct rtentry route;

    memset(&route, 0, sizeof route);
    set_address(&route.rt_dst, "224.0.0.0");
    set_address(&route.rt_genmask, "240.0.0.0");
    set_address(&route.rt_gateway, "0.0.0.0");
    route.rt_dev = device;
    route.rt_flags = RTF_UP;
    return ioctl(sock, SIOCADDRT, &route);
}

static int enter(void)
{
    int sock, status, saved;

    if (leave_the_old_net() != 0)
        return -1;
    sock = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (sock < 0)
        return -1;
    status = loopback_up(sock) == 0 ? multicast_route(sock) : -1;
    saved = errno;
    close(sock);
    errno = saved;
    return status;
}

/* There is no way back from a namespace half made, so a child goes first. */
int private_net_enter(void)
{
    int status;
    pid_t child = fork(), ended;

    if (child < 0)
        return -1;
    if (child == 0)
        _exit(enter() == 0 ? 0 : errno & 0xff);
    do
        ended = waitpid(child, &status, 0);
    while (ended < 0 && errno == EINTR);
    if (ended < 0)
        return -1;
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        errno = WIFEXITED(status) ? WEXITSTATUS(status) : EIO;
        return -1;
    }
    return enter();
}

void private_net_shared_url(char *url, int size, unsigned seed)
{
    unsigned h = seed * 2654435761U;

    h ^= h >> 15;
    /* 239.255/16 stays within a site; ports below those handed out to
     * programs that ask for any. */
    snprintf(url, (size_t)size, "udpm://239.255.%u.%u:%u?ttl=0",
             h & 0xff, 1 + (h >> 8) % 254, 20000 + (h >> 16) % 10000);
}
