/* Preloaded before libc: lets the n-th call that changes the disk fail, and after it all or none of the others. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_long calls;
static long first = -1; /* the call that fails, from 0; none while negative */
static int number;      /* errno */
static int stays;       /* whether all later calls fail too */

void failing_arm(long call, int error, int later) {
    first = call, number = error, stays = later;
    atomic_store(&calls, 0);
}

long failing_calls(void) { return atomic_load(&calls); }

static int fails(void) {
    long own = atomic_fetch_add(&calls, 1);
    if (first < 0 || (stays ? own < first : own != first)) return 0;
    errno = number;
    return 1;
}

/* Whether it is a file or folder on the disk, and none of the pipes and events that threads wake each other by. */
static int on_disk(int fd) {
    struct stat found;
    return fd > 2 && fstat(fd, &found) == 0 && (S_ISREG(found.st_mode) || S_ISDIR(found.st_mode));
}

#define REAL(name) ((typeof(&name))dlsym(RTLD_NEXT, #name))
#define OVER(kind, name, parameters, arguments) \
    kind name parameters { return fails() ? -1 : REAL(name) arguments; }
#define OVER_FILE(kind, name, parameters, arguments) \
    kind name parameters { return on_disk(fd) && fails() ? -1 : REAL(name) arguments; }

OVER_FILE(ssize_t, write, (int fd, const void *data, size_t size), (fd, data, size))
OVER_FILE(ssize_t, pwrite, (int fd, const void *data, size_t size, off_t at), (fd, data, size, at))
OVER_FILE(ssize_t, pwrite64, (int fd, const void *data, size_t size, off64_t at), (fd, data, size, at))
OVER_FILE(ssize_t, writev, (int fd, const struct iovec *parts, int count), (fd, parts, count))
OVER_FILE(int, fsync, (int fd), (fd))
OVER_FILE(int, fdatasync, (int fd), (fd))
OVER(int, rename, (const char *from, const char *to), (from, to))
OVER(int, renameat, (int a, const char *from, int b, const char *to), (a, from, b, to))
OVER(int, renameat2, (int a, const char *from, int b, const char *to, unsigned flags), (a, from, b, to, flags))
OVER(int, link, (const char *from, const char *to), (from, to))
OVER(int, linkat, (int a, const char *from, int b, const char *to, int flags), (a, from, b, to, flags))
OVER(int, mkdir, (const char *path, mode_t mode), (path, mode))
OVER(ssize_t, sendfile, (int out, int in, off_t *at, size_t size), (out, in, at, size))
OVER(ssize_t, copy_file_range, (int in, off64_t *a, int out, off64_t *b, size_t size, unsigned flags),
     (in, a, out, b, size, flags))
