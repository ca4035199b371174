/*
 * Preloaded into the user-mode kernel on CPUs with AMX.
 *
 * The kernel writes the vector registers of its processes back by ptrace from a buffer that ends after AVX-512 (2696
 * bytes). Where the CPU has more, the host takes its whole size or nothing (EFAULT), and the guest dies with its first
 * process. So the buffer is made longer here; what follows in it is zero, the state of registers not in use, and no
 * process of a guest can use them.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

long ptrace(enum __ptrace_request request, ...)
{
	va_list arguments;
	va_start(arguments, request);
	pid_t process = va_arg(arguments, pid_t);
	void *address = va_arg(arguments, void *);
	void *data = va_arg(arguments, void *);
	va_end(arguments);

	static long (*libc_ptrace)(enum __ptrace_request, ...);
	if (!libc_ptrace)
		libc_ptrace = dlsym(RTLD_NEXT, "ptrace");

	static char state[1 << 16]; /* the host takes of it what its CPU has */
	struct iovec wide = {state, sizeof state};
	if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
		struct iovec *given = data;
		memcpy(state, given->iov_base, given->iov_len);
		data = &wide;
	}
	return libc_ptrace(request, process, address, data);
}
