/* A network of one's own for one run: a new network namespace with only a
 * loopback, up, and a route that puts multicast on it. */
#ifndef SIM_PRIVATE_NET_H
#define SIM_PRIVATE_NET_H

/* Move this process (single-threaded so far) and its future children into a
 * new network namespace: with unshare(2), as root or through a user namespace.
 * Returns 0; or -1 with errno set, in the old network, unharmed, where that is
 * not allowed. */
int private_net_enter(void);

/* An LCM address for a run on the machine's own network: ttl 0, a multicast
 * address and port drawn from seed.  url [size]. */
void private_net_shared_url(char *url, int size, unsigned seed);

#endif
