/* A disk that fails: the n-th write to a regular file (FAIL_AT, from 1) gives the error FAIL_WITH, and so do all after it. At the end the
   number of writes is told on standard error where FAIL_AT is 0. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_long n_writes;

static int fails(int fd) {
    struct stat file;
    if (fstat(fd, &file) != 0 || !S_ISREG(file.st_mode)) return 0;
    const char *at = getenv("FAIL_AT"), *with = getenv("FAIL_WITH");
    long n = atomic_fetch_add(&n_writes, 1) + 1, last = at ? atol(at) : 0;
    if (last == 0 || n < last) return 0;
    errno = with ? atoi(with) : ENOSPC;
    return 1;
}

ssize_t write(int fd, const void *bytes, size_t n) {
    static ssize_t (*system_write)(int, const void *, size_t);
    if (!system_write) system_write = (ssize_t (*)(int, const void *, size_t))dlsym(RTLD_NEXT, "write");
    return fails(fd) ? -1 : system_write(fd, bytes, n);
}

ssize_t writev(int fd, const struct iovec *parts, int n) {
    static ssize_t (*system_writev)(int, const struct iovec *, int);
    if (!system_writev) system_writev = (ssize_t (*)(int, const struct iovec *, int))dlsym(RTLD_NEXT, "writev");
    return fails(fd) ? -1 : system_writev(fd, parts, n);
}

__attribute__((destructor)) static void tell(void) {
    const char *at = getenv("FAIL_AT");
    if (at && atol(at) == 0) fprintf(stderr, "writes: %ld\n", (long)n_writes);
}
