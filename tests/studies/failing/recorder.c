/* Preloaded before libc: notes the calls that change files of one folder, RECORDED_FOLDER, in their order.

Each goes to the file RECORDED_CALLS when it has been made, with the bytes that it wrote, see `recorder.py`; so do
flushes, and what is said on standard output. One lock keeps the order of what several threads and processes do. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { CREATE = 1, FOLDER, WRITE, RESIZE, LINK, RENAME, REMOVE, FLUSH, FLUSH_ALL, SAY };  /* as recorder.py has them */

struct header {
    int64_t kind;
    int64_t file;    /* its inode */
    int64_t at;      /* where bytes are written; a size; flags of a rename */
    int64_t path;    /* lengths of what follows */
    int64_t target;
    int64_t data;
};
static const char *folder;
static int record = -1;
static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER;

static void take(void) { pthread_mutex_lock(&turn); }
static void give(void) { pthread_mutex_unlock(&turn); }

__attribute__((constructor)) static void attach(void) {
    const char *path = getenv("RECORDED_CALLS");
    folder = getenv("RECORDED_FOLDER");
    if (!path || !folder) return;
    int file = syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_APPEND | O_CLOEXEC, 0);
    if (file < 0) return;
    record = syscall(SYS_fcntl, file, F_DUPFD_CLOEXEC, 300);  /* away from the numbers that programs expect */
    syscall(SYS_close, file);
    pthread_atfork(take, give, give);
}

/* The lock, of all threads and processes. */
static void begin(void) {
    struct flock whole = {.l_type = F_WRLCK};
    take();
    while (syscall(SYS_fcntl, record, F_SETLKW, &whole) < 0 && errno == EINTR) continue;
}

static void end(void) {
    struct flock whole = {.l_type = F_UNLCK};
    int before = errno;
    syscall(SYS_fcntl, record, F_SETLK, &whole);
    give();
    errno = before;
}

static int inside(const char *path) {
    size_t length = strlen(folder);
    return strncmp(path, folder, length) == 0 && (path[length] == '/' || !path[length]);
}

/* A path as a whole, and whether it is in the folder; that of a descriptor itself where there is no path. */
static int find(int fd, const char *path, char *whole) {
    char link[64] = "/proc/self/cwd";
    int before = errno;
    if (record < 0) return 0;
    if (path && path[0] == '/')
        snprintf(whole, 2 * PATH_MAX, "%s", path);
    else {
        if (fd != AT_FDCWD) snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
        long length = syscall(SYS_readlinkat, AT_FDCWD, link, whole, PATH_MAX - 1);
        if (length < 0) length = 0;
        whole[length] = 0;
        if (path && path[0]) snprintf(whole + length, PATH_MAX, "/%s", path);
    }
    errno = before;
    return inside(whole);
}

static int find_file(int fd) {
    char whole[2 * PATH_MAX];
    return find(fd, NULL, whole);
}

static void note(int kind, int64_t file, int64_t at, const char *path, const char *target, const void *data,
                 size_t size) {
    int before = errno;
    struct header header = {kind, file, at, strlen(path), strlen(target), size};
    struct iovec parts[] = {{&header, sizeof header}, {(void *)path, header.path}, {(void *)target, header.target},
                            {(void *)data, size}};
    if (syscall(SYS_writev, record, parts, 4) != (long)(sizeof header + header.path + header.target + size)) _exit(70);
    errno = before;
}

static int64_t identity(int fd) {
    struct stat found;
    return fstat(fd, &found) ? 0 : (int64_t)found.st_ino;
}

/* The bytes that were written: read back, whatever call wrote them. A negative place ends where the file is at. */
static void note_bytes(int fd, off_t at, ssize_t size) {
    char link[64], *bytes = malloc(size);
    int before = errno;
    if (at < 0) at = lseek(fd, 0, SEEK_CUR) - size;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    int file = syscall(SYS_openat, AT_FDCWD, link, O_RDONLY | O_CLOEXEC, 0);
    if (syscall(SYS_pread64, file, bytes, size, at) != size) _exit(70);
    syscall(SYS_close, file);
    note(WRITE, identity(fd), at, "", "", bytes, size);
    free(bytes);
    errno = before;
}

static void note_size(int fd) {
    struct stat found;
    int before = errno;
    if (!fstat(fd, &found)) note(RESIZE, found.st_ino, found.st_size, "", "", NULL, 0);
    errno = before;
}

#define REAL(name) ((typeof(&name))dlsym(RTLD_NEXT, #name))
/* A call on a descriptor: what is noted of it once it has been made. */
#define ON_FILE(type, name, fd, parameters, arguments, right, noted) \
    type name parameters { \
        if (!find_file(fd)) return REAL(name) arguments; \
        begin(); \
        type done = REAL(name) arguments; \
        if (right) noted; \
        end(); \
        return done; \
    }
#define WRITES(name, parameters, arguments, fd, at) \
    ON_FILE(ssize_t, name, fd, parameters, arguments, done > 0, note_bytes(fd, at, done))

ssize_t write(int fd, const void *data, size_t size) {
    int own = record >= 0 && (fd == STDOUT_FILENO || find_file(fd));
    if (!own) return REAL(write)(fd, data, size);
    begin();
    ssize_t done = REAL(write)(fd, data, size);
    if (fd == STDOUT_FILENO)
        note(SAY, 0, 0, "", "", data, done > 0 ? done : 0);
    else if (done > 0)
        note_bytes(fd, -1, done);
    end();
    return done;
}

WRITES(pwrite, (int fd, const void *data, size_t size, off_t at), (fd, data, size, at), fd, at)
WRITES(pwrite64, (int fd, const void *data, size_t size, off64_t at), (fd, data, size, at), fd, at)
WRITES(writev, (int fd, const struct iovec *parts, int count), (fd, parts, count), fd, -1)
WRITES(pwritev, (int fd, const struct iovec *parts, int count, off_t at), (fd, parts, count, at), fd, at)
WRITES(pwritev64, (int fd, const struct iovec *parts, int count, off64_t at), (fd, parts, count, at), fd, at)
WRITES(sendfile, (int out, int in, off_t *at, size_t size), (out, in, at, size), out, -1)
WRITES(sendfile64, (int out, int in, off64_t *at, size_t size), (out, in, at, size), out, -1)
WRITES(copy_file_range, (int in, off64_t *a, int out, off64_t *b, size_t size, unsigned flags),
       (in, a, out, b, size, flags), out, b ? *b - done : -1)
ON_FILE(int, fsync, fd, (int fd), (fd), done == 0, note(FLUSH, identity(fd), 0, "", "", NULL, 0))
ON_FILE(int, fdatasync, fd, (int fd), (fd), done == 0, note(FLUSH, identity(fd), 0, "", "", NULL, 0))
ON_FILE(int, syncfs, fd, (int fd), (fd), done == 0, note(FLUSH_ALL, 0, 0, "", "", NULL, 0))
ON_FILE(int, ftruncate, fd, (int fd, off_t size), (fd, size), done == 0, note_size(fd))
ON_FILE(int, ftruncate64, fd, (int fd, off64_t size), (fd, size), done == 0, note_size(fd))
ON_FILE(int, fallocate, fd, (int fd, int mode, off_t at, off_t size), (fd, mode, at, size), done == 0, note_size(fd))
ON_FILE(int, fallocate64, fd, (int fd, int mode, off64_t at, off64_t size), (fd, mode, at, size), done == 0,
        note_size(fd))
ON_FILE(int, posix_fallocate, fd, (int fd, off_t at, off_t size), (fd, at, size), done == 0, note_size(fd))
ON_FILE(int, posix_fallocate64, fd, (int fd, off64_t at, off64_t size), (fd, at, size), done == 0, note_size(fd))

void sync(void) {
    REAL(sync)();
    if (record < 0) return;
    begin();
    note(FLUSH_ALL, 0, 0, "", "", NULL, 0);
    end();
}

#define OPEN(name, at, parameters, arguments) \
    int name parameters { \
        va_list more; \
        va_start(more, flags); \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0; \
        va_end(more); \
        char whole[2 * PATH_MAX]; \
        int nameless = (flags & O_TMPFILE) == O_TMPFILE; \
        if (!(nameless || flags & (O_CREAT | O_TRUNC)) || !find(at, path, whole)) return REAL(name) arguments; \
        struct stat found; \
        begin(); \
        int there = !nameless && !lstat(whole, &found), file = REAL(name) arguments; \
        if (file >= 0 && !there) \
            note(CREATE, identity(file), 0, nameless ? "" : whole, "", NULL, 0); \
        else if (file >= 0 && flags & O_TRUNC) \
            note_size(file); \
        end(); \
        return file; \
    }
OPEN(open, AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode))
OPEN(open64, AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode))
OPEN(openat, fd, (int fd, const char *path, int flags, ...), (fd, path, flags, mode))
OPEN(openat64, fd, (int fd, const char *path, int flags, ...), (fd, path, flags, mode))

int creat(const char *path, mode_t mode) { return open(path, O_CREAT | O_WRONLY | O_TRUNC, mode); }
int creat64(const char *path, mode_t mode) { return open(path, O_CREAT | O_WRONLY | O_TRUNC, mode); }

#define MAKES_FOLDER(name, at, parameters, arguments) \
    int name parameters { \
        char whole[2 * PATH_MAX]; \
        struct stat found; \
        if (!find(at, path, whole)) return REAL(name) arguments; \
        begin(); \
        int done = REAL(name) arguments; \
        if (done == 0 && !lstat(whole, &found)) note(FOLDER, found.st_ino, 0, whole, "", NULL, 0); \
        end(); \
        return done; \
    }
MAKES_FOLDER(mkdir, AT_FDCWD, (const char *path, mode_t mode), (path, mode))
MAKES_FOLDER(mkdirat, fd, (int fd, const char *path, mode_t mode), (fd, path, mode))

#define ON_PATH(name, at, parameters, arguments) \
    int name parameters { \
        char whole[2 * PATH_MAX]; \
        if (!find(at, path, whole)) return REAL(name) arguments; \
        begin(); \
        int done = REAL(name) arguments; \
        if (done == 0) note(REMOVE, 0, 0, whole, "", NULL, 0); \
        end(); \
        return done; \
    }
ON_PATH(unlink, AT_FDCWD, (const char *path), (path))
ON_PATH(unlinkat, fd, (int fd, const char *path, int flags), (fd, path, flags))
ON_PATH(rmdir, AT_FDCWD, (const char *path), (path))
ON_PATH(remove, AT_FDCWD, (const char *path), (path))

#define TRUNCATES(name, type) \
    int name(const char *path, type size) { \
        char whole[2 * PATH_MAX]; \
        struct stat found; \
        if (!find(AT_FDCWD, path, whole)) return REAL(name)(path, size); \
        begin(); \
        int done = REAL(name)(path, size); \
        if (done == 0 && !stat(whole, &found)) note(RESIZE, found.st_ino, size, "", "", NULL, 0); \
        end(); \
        return done; \
    }
TRUNCATES(truncate, off_t)
TRUNCATES(truncate64, off64_t)

#define TWO_PATHS(kind, name, a, b, flags, parameters, arguments) \
    int name parameters { \
        char source[2 * PATH_MAX], target[2 * PATH_MAX]; \
        int known = find(a, from, source); \
        if (!(find(b, to, target) || known)) return REAL(name) arguments; \
        begin(); \
        int done = REAL(name) arguments; \
        if (done == 0) note(kind, 0, flags, source, target, NULL, 0); \
        end(); \
        return done; \
    }
TWO_PATHS(RENAME, rename, AT_FDCWD, AT_FDCWD, 0, (const char *from, const char *to), (from, to))
TWO_PATHS(RENAME, renameat, a, b, 0, (int a, const char *from, int b, const char *to), (a, from, b, to))
TWO_PATHS(RENAME, renameat2, a, b, flags, (int a, const char *from, int b, const char *to, unsigned flags),
          (a, from, b, to, flags))
TWO_PATHS(LINK, link, AT_FDCWD, AT_FDCWD, 0, (const char *from, const char *to), (from, to))
TWO_PATHS(LINK, linkat, a, b, 0, (int a, const char *from, int b, const char *to, int flags), (a, from, b, to, flags))
