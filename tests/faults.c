/* Counts the system calls that change files below a folder, and lets one of them fail, kill or interrupt: LD_PRELOAD. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { FAIL_ONCE, FAIL_ON, KILL, INTERRUPT };

static char folder[4096];
static long fault_at, calls;
static int kind;

void faults_arm(const char *below, long n, int what)
{
    snprintf(folder, sizeof folder, "%s", below);
    fault_at = n;
    calls = 0;
    kind = what;
}

long faults_count(void) { return calls; }

static int inside(const char *path) { return folder[0] && path && !strncmp(path, folder, strlen(folder)); }

static int is_file_inside(int descriptor)
{
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t n = folder[0] ? readlink(link, path, sizeof path - 1) : -1;
    if (n < 0)
        return 0;
    path[n] = 0;
    return inside(path);
}

/* Return 1 if this call is to fail; `keeps` is 1 for calls that succeed on a full disk, such as rename. */
static int fault(int applies, int keeps)
{
    if (!applies)
        return 0;
    long n = __atomic_add_fetch(&calls, 1, __ATOMIC_SEQ_CST);
    if (n < fault_at || fault_at <= 0 || (n > fault_at && kind != FAIL_ON) || (kind == FAIL_ON && keeps))
        return 0;
    if (kind == KILL)
        kill(getpid(), SIGKILL);
    if (kind == INTERRUPT)
        kill(getpid(), SIGINT);
    errno = ENOSPC;
    return kind == FAIL_ONCE || kind == FAIL_ON;
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...)                                                                         \
    {                                                                                                                  \
        va_list list;                                                                                                  \
        va_start(list, flags);                                                                                         \
        int mode = va_arg(list, int);                                                                                  \
        va_end(list);                                                                                                  \
        if (fault((flags & O_CREAT) && inside(path), 0))                                                               \
            return -1;                                                                                                 \
        return NEXT(name)(path, flags, mode);                                                                          \
    }
OPEN(open)
OPEN(open64)

#define WRITE(result, name, declaration, arguments, descriptor)                                                        \
    result name declaration                                                                                            \
    {                                                                                                                  \
        return fault(is_file_inside(descriptor), 0) ? -1 : NEXT(name) arguments;                                       \
    }
WRITE(ssize_t, write, (int fd, const void *data, size_t n), (fd, data, n), fd)
WRITE(ssize_t, pwrite64, (int fd, const void *data, size_t n, off64_t at), (fd, data, n, at), fd)
WRITE(ssize_t, writev, (int fd, const struct iovec *parts, int n), (fd, parts, n), fd)
WRITE(ssize_t, sendfile64, (int fd, int from, off64_t *at, size_t n), (fd, from, at, n), fd)
WRITE(ssize_t, copy_file_range, (int in, off64_t *a, int fd, off64_t *b, size_t n, unsigned flags),
      (in, a, fd, b, n, flags), fd)

int rename(const char *from, const char *to) { return fault(inside(to), 1) ? -1 : NEXT(rename)(from, to); }

int mkdir(const char *path, mode_t mode) { return fault(inside(path), 0) ? -1 : NEXT(mkdir)(path, mode); }
