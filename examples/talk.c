/* Drives a robot from C: JSON-RPC over the daemon's socket, one object a line. Build it: cc -o talk examples/talk.c
 * Start a daemon first (canhelm run --simulate --profile max2d), then ./talk SOCKET */
#include <err.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
static FILE *to, *from;

static void request(int id, const char *method, const char *params)
{
	fprintf(to, "{\"jsonrpc\":\"2.0\",\"id\":%d,\"method\":\"%s\",\"params\":%s}\n", id, method, params);
}

static void call(const char *method, const char *params)
{ /* waits for the answer; a lease that is not renewed runs out after 1.5 s, and the motion stops */
	char answer[65536] = "\"id\":0,";
	request(1, method, params);
	while (strstr(answer, "\"id\":0,")) {
		while (poll(&(struct pollfd){.fd = fileno(from), .events = POLLIN}, 1, 500) == 0)
			request(0, "lease.renew", "{}");
		if (!fgets(answer, sizeof answer, from) || strstr(answer, "\"error\":"))
			errx(1, "%s: %s", method, answer);
	}
	printf("%s: %s", method, strstr(answer, "\"result\""));
}

int main(int argc, char **argv)
{
	struct sockaddr_un place = {.sun_family = AF_UNIX};
	int fd = socket(AF_UNIX, SOCK_STREAM, 0);
	strncpy(place.sun_path, argc > 1 ? argv[1] : "", sizeof place.sun_path - 1);
	if (connect(fd, (struct sockaddr *)&place, sizeof place) || !(to = fdopen(fd, "w")) || !(from = fdopen(fd, "r")))
		err(3, "%s", place.sun_path);
	setvbuf(to, NULL, _IOLBF, 0);
	setvbuf(from, NULL, _IONBF, 0);
	call("steer", "{\"pair\":\"front\",\"angle_deg\":20}");
	call("drive.turn", "{\"rear_deg\":-20,\"front_deg\":20,\"speed_m_s\":0.3,\"duration_s\":1}");
}
