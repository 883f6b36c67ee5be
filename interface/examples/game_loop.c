/* SPDX-License-Identifier: GPL-3.0-or-later
 * A game: a servo thread calls the ticks at the scene's rate, and the game's loop draws at 60 Hz.
 *   game_loop SCENE.toml [SECONDS]    2 s by default; the tool goes up and down over the middle of the scene
 * Neither thread waits for the other. A real game reads the tool's position from a driver, and writes the
 * force to that driver. It gives the servo thread real-time priority (pthread_setschedparam), and draws with
 * its own engine. Build: cc game_loop.c $(pkg-config --cflags --libs hybrid) -lm -pthread -o game_loop */
#define _POSIX_C_SOURCE 200809L
#include <hybrid.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define FRAME_S (1.0 / 60.0)
#define TICKS_PER_PUBLISH 16 /* surfaces for each frame, at 1 kHz */
#define STROKE_S 1.0         /* time of one way down and up */

typedef struct game {
  hybrid_session* session;
  hybrid_info info;
  double seconds;
  atomic_bool over;
  atomic_ulong ticks, late, contact_ticks;
} game;

static void need(hybrid_code code) {
  if (code == HYBRID_OK) return;
  fprintf(stderr, "%s: %s\n", hybrid_code_name(code), hybrid_error_text());
  exit(1);
}

static struct timespec later(struct timespec at, double seconds) {
  at.tv_nsec += (long)(1e9 * seconds);
  while (at.tv_nsec >= 1000000000L) {
    at.tv_nsec -= 1000000000L;
    ++at.tv_sec;
  }
  return at;
}

/* Stands in for a device: from above the scene to its middle and back. */
static void device_position(const game* g, double t_s, double at_m[3]) {
  const double top_m = g->info.high_m[2] + 2.0 * g->info.tool_radius_m;
  const double middle_m = 0.5 * (g->info.low_m[2] + g->info.high_m[2]);
  const double share = 0.5 - 0.5 * cos(2.0 * acos(-1.0) * t_s / STROKE_S);
  at_m[0] = at_m[1] = 0.0;
  at_m[2] = top_m + share * (middle_m - top_m);
}

static void* servo(void* argument) {
  game* g = argument;
  const unsigned long ticks = (unsigned long)(g->seconds / g->info.period_s);
  hybrid_felt felt = {.size = sizeof felt};
  struct timespec next, now;
  unsigned long tick;
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (tick = 0; tick < ticks; ++tick) {
    double at_m[3];
    device_position(g, (double)tick * g->info.period_s, at_m);
    need(hybrid_tick(g->session, at_m, NULL, g->info.period_s, &felt));
    /* here felt.force_N goes to the driver */
    if (felt.contact_count > 0) atomic_fetch_add(&g->contact_ticks, 1);
    if (tick % TICKS_PER_PUBLISH == 0) need(hybrid_publish(g->session));
    atomic_store(&g->ticks, tick + 1);
    next = later(next, g->info.period_s);
    clock_gettime(CLOCK_MONOTONIC, &now);
    if (now.tv_sec > next.tv_sec || (now.tv_sec == next.tv_sec && now.tv_nsec > next.tv_nsec)) {
      atomic_fetch_add(&g->late, 1);
      next = now; /* time that was lost is not made up for by faster ticks */
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
  }
  atomic_store(&g->over, true);
  return NULL;
}

/* Takes the surfaces that changed since the frame before, as a game would draw them. Returns their number. */
static unsigned draw(game* g, double** vertices_m, const hybrid_object* objects) {
  hybrid_snapshot snapshot = {.size = sizeof snapshot};
  unsigned drawn = 0;
  uint32_t o;
  need(hybrid_take_snapshot(g->session, &snapshot));
  if (!snapshot.is_fresh) return 0;
  for (o = 0; o < g->info.objects; ++o) {
    int changed = 0;
    need(hybrid_vertices(g->session, o, NULL, 0, &changed));
    if (!changed) continue;
    need(hybrid_vertices(g->session, o, vertices_m[o], objects[o].vertices, NULL));
    ++drawn; /* here vertices_m[o] goes to the graphics card */
  }
  return drawn;
}

int main(int count, char** words) {
  static game g;
  hybrid_options options = {.size = sizeof options, .relaxation = HYBRID_RELAX_THREAD};
  hybrid_object* objects;
  double **vertices_m, at_m[3];
  struct timespec next;
  unsigned frames = 0, surfaces = 0;
  pthread_t servo_thread;
  uint32_t o;

  if (count != 2 && count != 3) {
    fprintf(stderr, "usage: game_loop SCENE.toml [SECONDS]\n");
    return 2;
  }
  g.seconds = count == 3 ? atof(words[2]) : 2.0;
  g.info.size = sizeof g.info;
  need(hybrid_open(words[1], &options, &g.session));
  need(hybrid_get_info(g.session, &g.info));
  objects = calloc(g.info.objects, sizeof *objects);
  vertices_m = calloc(g.info.objects, sizeof *vertices_m);
  if (objects == NULL || vertices_m == NULL) return 1;
  for (o = 0; o < g.info.objects; ++o) {
    objects[o].size = sizeof objects[o];
    need(hybrid_get_object(g.session, o, &objects[o]));
    vertices_m[o] = malloc(3 * objects[o].vertices * sizeof **vertices_m);
    printf("%s: %s, %llu vertices\n", objects[o].name, objects[o].is_soft ? "soft" : "rigid",
           (unsigned long long)objects[o].vertices);
  }
  device_position(&g, 0.0, at_m);
  need(hybrid_begin(g.session, at_m));
  if (pthread_create(&servo_thread, NULL, servo, &g) != 0) return 1;

  clock_gettime(CLOCK_MONOTONIC, &next);
  while (!atomic_load(&g.over)) {
    surfaces += draw(&g, vertices_m, objects);
    if (++frames == 30) need(hybrid_edit(g.session, NULL, "stiffness", 500.0)); /* as a slider would */
    next = later(next, FRAME_S);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
  }
  pthread_join(servo_thread, NULL);
  printf("%lu ticks, %lu in contact, %lu late; %u frames, %u surfaces drawn\n", atomic_load(&g.ticks),
         atomic_load(&g.contact_ticks), atomic_load(&g.late), frames, surfaces);
  need(hybrid_close(g.session));
  for (o = 0; o < g.info.objects; ++o) free(vertices_m[o]);
  free(vertices_m);
  free(objects);
  return 0;
}
