/* Preloaded before libc: lets the n-th call on files of one folder fail, and after it all or none of the others.

What is asked for stands in a file of shared memory (FAILING_CALLS), so that it holds for all processes of a command.
Counted are calls on paths of the folder, and on descriptors of its files. The calls of the trace, FAILING_CALLS.trace,
are numbered as they fail. */

#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { READS = 1, WRITES = 2 };

static struct {
    atomic_long calls;
    long first;         /* the call that fails, from 0; none while negative */
    int number;         /* errno; the process is killed instead where it is negative */
    int stays;          /* whether all later calls fail too */
    int kinds;          /* READS, WRITES or both; 0 counts none */
    int traced;         /* whether the trace is written */
    char folder[1024];
} *state;
static int trace = -1;

__attribute__((constructor)) static void attach(void) {
    const char *path = getenv("FAILING_CALLS");
    char beside[PATH_MAX];
    if (!path) return;
    int file = syscall(SYS_open, path, O_RDWR | O_CLOEXEC, 0);
    if (file < 0) return;
    void *memory = (void *)syscall(SYS_mmap, NULL, sizeof *state, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0L);
    syscall(SYS_close, file);
    snprintf(beside, sizeof beside, "%s.trace", path);
    trace = syscall(SYS_open, beside, O_WRONLY | O_APPEND | O_CLOEXEC, 0);
    if (memory != MAP_FAILED) state = memory;
}

/* Where a descriptor, or the working folder (AT_FDCWD), leads; the length of the text, 0 if nowhere. */
static size_t of_descriptor(int fd, char *text) {
    char link[64] = "/proc/self/cwd";
    if (fd != AT_FDCWD) snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    long length = syscall(SYS_readlinkat, AT_FDCWD, link, text, PATH_MAX - 1);
    if (length < 0) length = 0;
    text[length] = 0;
    return length;
}

static int fails(int kind, const char *name, int fd, const char *path) {
    if (!state || !(state->kinds & kind)) return 0;
    char whole[2 * PATH_MAX];
    int before = errno, fail = 0;
    if (path && path[0] == '/')
        snprintf(whole, sizeof whole, "%s", path);
    else {
        size_t length = of_descriptor(fd, whole);
        if (path && path[0]) snprintf(whole + length, sizeof whole - length, "/%s", path);
    }
    size_t length = strlen(state->folder);
    if (strncmp(whole, state->folder, length) == 0 && (whole[length] == '/' || !whole[length])) {
        long own = atomic_fetch_add(&state->calls, 1);
        if (state->traced && trace >= 0) {
            char line[2 * PATH_MAX + 64];
            int size = snprintf(line, sizeof line, "%ld %s %s\n", own, name, whole + length);
            syscall(SYS_write, trace, line, size);
        }
        fail = state->first >= 0 && (state->stays ? own >= state->first : own == state->first);
    }
    if (fail && state->number < 0) kill(getpid(), SIGKILL);
    errno = !fail ? before : kind == READS && state->number == ENOSPC ? EIO : state->number;
    return fail;
}

static int on_file(int kind, const char *name, int fd) { return fd > 2 && fails(kind, name, fd, NULL); }

static int opening(int flags) { return flags & (O_WRONLY | O_RDWR | O_CREAT) ? WRITES : READS; }

#define REAL(name) ((typeof(&name))dlsym(RTLD_NEXT, #name))
#define ON_PATH(kind, type, name, at, path, parameters, arguments) \
    type name parameters { return fails(kind, #name, at, path) ? (type)-1 : REAL(name) arguments; }
#define ON_FILE(kind, type, name, parameters, arguments) \
    type name parameters { return on_file(kind, #name, fd) ? (type)-1 : REAL(name) arguments; }

ON_FILE(WRITES, ssize_t, write, (int fd, const void *data, size_t size), (fd, data, size))
ON_FILE(WRITES, ssize_t, pwrite, (int fd, const void *data, size_t size, off_t at), (fd, data, size, at))
ON_FILE(WRITES, ssize_t, pwrite64, (int fd, const void *data, size_t size, off64_t at), (fd, data, size, at))
ON_FILE(WRITES, ssize_t, writev, (int fd, const struct iovec *parts, int count), (fd, parts, count))
ON_FILE(WRITES, int, fsync, (int fd), (fd))
ON_FILE(WRITES, int, fdatasync, (int fd), (fd))
ON_FILE(WRITES, int, ftruncate, (int fd, off_t size), (fd, size))
ON_FILE(WRITES, int, ftruncate64, (int fd, off64_t size), (fd, size))
ON_FILE(WRITES, int, fchmod, (int fd, mode_t mode), (fd, mode))
ON_FILE(WRITES, int, futimens, (int fd, const struct timespec times[2]), (fd, times))
ON_FILE(WRITES, int, flock, (int fd, int operation), (fd, operation))
ON_PATH(WRITES, int, rename, AT_FDCWD, from, (const char *from, const char *to), (from, to))
ON_PATH(WRITES, int, renameat, a, from, (int a, const char *from, int b, const char *to), (a, from, b, to))
ON_PATH(WRITES, int, renameat2, a, from, (int a, const char *from, int b, const char *to, unsigned flags),
        (a, from, b, to, flags))
ON_PATH(WRITES, int, link, AT_FDCWD, from, (const char *from, const char *to), (from, to))
ON_PATH(WRITES, int, linkat, a, from, (int a, const char *from, int b, const char *to, int flags),
        (a, from, b, to, flags))
ON_PATH(WRITES, int, mkdir, AT_FDCWD, path, (const char *path, mode_t mode), (path, mode))
ON_PATH(WRITES, int, mkdirat, fd, path, (int fd, const char *path, mode_t mode), (fd, path, mode))
ON_PATH(WRITES, int, unlink, AT_FDCWD, path, (const char *path), (path))
ON_PATH(WRITES, int, unlinkat, fd, path, (int fd, const char *path, int flags), (fd, path, flags))
ON_PATH(WRITES, int, rmdir, AT_FDCWD, path, (const char *path), (path))
ON_PATH(WRITES, int, remove, AT_FDCWD, path, (const char *path), (path))
ON_PATH(WRITES, int, chmod, AT_FDCWD, path, (const char *path, mode_t mode), (path, mode))
ON_PATH(WRITES, int, fchmodat, fd, path, (int fd, const char *path, mode_t mode, int flags), (fd, path, mode, flags))
ON_PATH(WRITES, int, utimensat, fd, path, (int fd, const char *path, const struct timespec times[2], int flags),
        (fd, path, times, flags))

ON_FILE(READS, ssize_t, read, (int fd, void *data, size_t size), (fd, data, size))
ON_FILE(READS, ssize_t, pread, (int fd, void *data, size_t size, off_t at), (fd, data, size, at))
ON_FILE(READS, ssize_t, pread64, (int fd, void *data, size_t size, off64_t at), (fd, data, size, at))
ON_FILE(READS, ssize_t, readv, (int fd, const struct iovec *parts, int count), (fd, parts, count))
ON_FILE(READS, ssize_t, preadv, (int fd, const struct iovec *parts, int count, off_t at), (fd, parts, count, at))
ON_FILE(READS, ssize_t, preadv64, (int fd, const struct iovec *parts, int count, off64_t at), (fd, parts, count, at))
ON_FILE(READS, void *, mmap, (void *to, size_t size, int access, int flags, int fd, off_t at),
        (to, size, access, flags, fd, at))
ON_FILE(READS, void *, mmap64, (void *to, size_t size, int access, int flags, int fd, off64_t at),
        (to, size, access, flags, fd, at))
ON_FILE(READS, int, fstat, (int fd, struct stat *found), (fd, found))
ON_FILE(READS, int, fstat64, (int fd, struct stat64 *found), (fd, found))
ON_PATH(READS, int, stat, AT_FDCWD, path, (const char *path, struct stat *found), (path, found))
ON_PATH(READS, int, stat64, AT_FDCWD, path, (const char *path, struct stat64 *found), (path, found))
ON_PATH(READS, int, lstat, AT_FDCWD, path, (const char *path, struct stat *found), (path, found))
ON_PATH(READS, int, lstat64, AT_FDCWD, path, (const char *path, struct stat64 *found), (path, found))
ON_PATH(READS, int, fstatat, fd, path, (int fd, const char *path, struct stat *found, int flags),
        (fd, path, found, flags))
ON_PATH(READS, int, fstatat64, fd, path, (int fd, const char *path, struct stat64 *found, int flags),
        (fd, path, found, flags))
ON_PATH(READS, int, statx, fd, path, (int fd, const char *path, int flags, unsigned mask, struct statx *found),
        (fd, path, flags, mask, found))
ON_PATH(READS, int, access, AT_FDCWD, path, (const char *path, int mode), (path, mode))
ON_PATH(READS, int, faccessat, fd, path, (int fd, const char *path, int mode, int flags), (fd, path, mode, flags))
ON_PATH(READS, ssize_t, readlink, AT_FDCWD, path, (const char *path, char *text, size_t size), (path, text, size))
ON_PATH(WRITES, ssize_t, sendfile, out, NULL, (int out, int in, off_t *at, size_t size), (out, in, at, size))
ON_PATH(WRITES, ssize_t, sendfile64, out, NULL, (int out, int in, off64_t *at, size_t size), (out, in, at, size))
ON_PATH(WRITES, ssize_t, copy_file_range, out, NULL,
        (int in, off64_t *a, int out, off64_t *b, size_t size, unsigned flags), (in, a, out, b, size, flags))

/* As libraries call it that were linked to a glibc before 2.33. */
#define ON_VERSIONED(name, at, path, parameters, arguments) \
    int name parameters { \
        return fails(READS, #name, at, path) ? -1 : ((int (*) parameters)dlsym(RTLD_NEXT, #name)) arguments; \
    }
ON_VERSIONED(__xstat, AT_FDCWD, path, (int v, const char *path, struct stat *found), (v, path, found))
ON_VERSIONED(__xstat64, AT_FDCWD, path, (int v, const char *path, struct stat64 *found), (v, path, found))
ON_VERSIONED(__lxstat, AT_FDCWD, path, (int v, const char *path, struct stat *found), (v, path, found))
ON_VERSIONED(__lxstat64, AT_FDCWD, path, (int v, const char *path, struct stat64 *found), (v, path, found))
ON_VERSIONED(__fxstat, fd, NULL, (int v, int fd, struct stat *found), (v, fd, found))
ON_VERSIONED(__fxstat64, fd, NULL, (int v, int fd, struct stat64 *found), (v, fd, found))
ON_VERSIONED(__fxstatat, fd, path, (int v, int fd, const char *path, struct stat *found, int flags),
             (v, fd, path, found, flags))
ON_VERSIONED(__fxstatat64, fd, path, (int v, int fd, const char *path, struct stat64 *found, int flags),
             (v, fd, path, found, flags))

#define OPEN(name, at, parameters, arguments) \
    int name parameters { \
        va_list more; \
        va_start(more, flags); \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0; \
        va_end(more); \
        return fails(opening(flags), #name, at, path) ? -1 : REAL(name) arguments; \
    }
OPEN(open, AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode))
OPEN(open64, AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode))
OPEN(openat, fd, (int fd, const char *path, int flags, ...), (fd, path, flags, mode))
OPEN(openat64, fd, (int fd, const char *path, int flags, ...), (fd, path, flags, mode))

#define OPEN_STREAM(name) \
    FILE *name(const char *path, const char *mode) { \
        return fails(mode[0] == 'r' && !strchr(mode, '+') ? READS : WRITES, #name, AT_FDCWD, path) \
            ? NULL : REAL(name)(path, mode); \
    }
OPEN_STREAM(fopen)
OPEN_STREAM(fopen64)

DIR *opendir(const char *path) { return fails(READS, "opendir", AT_FDCWD, path) ? NULL : REAL(opendir)(path); }
DIR *fdopendir(int fd) { return on_file(READS, "fdopendir", fd) ? NULL : REAL(fdopendir)(fd); }
struct dirent *readdir(DIR *folder) {
    return on_file(READS, "readdir", dirfd(folder)) ? NULL : REAL(readdir)(folder);
}
struct dirent64 *readdir64(DIR *folder) {
    return on_file(READS, "readdir64", dirfd(folder)) ? NULL : REAL(readdir64)(folder);
}
