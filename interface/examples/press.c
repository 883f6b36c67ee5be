/* SPDX-License-Identifier: GPL-3.0-or-later
 * Presses a ball into a scene along -z and prints the force over the depth.
 *   press SCENE.toml [TOP_mm BOTTOM_mm]    from x = y = 0; default: from above the scene to its middle
 * Build: cc press.c $(pkg-config --cflags --libs hybrid) -o press */
#include <hybrid.h>
#include <stdio.h>
#include <stdlib.h>

enum { TICKS = 1000, LINES = 10 };

/* Ends the program with the reason if a call failed. */
static void need(hybrid_code code) {
  if (code == HYBRID_OK) return;
  fprintf(stderr, "%s: %s\n", hybrid_code_name(code), hybrid_error_text());
  exit(1);
}

int main(int count, char** words) {
  hybrid_session* session = NULL;
  hybrid_options options = {.size = sizeof options, .recorded_ticks = TICKS, .without_surfaces = 1};
  hybrid_info info = {.size = sizeof info};
  hybrid_felt felt = {.size = sizeof felt};
  double at_m[3] = {0.0, 0.0, 0.0}, top_m, bottom_m;
  int tick;

  if (count != 2 && count != 4) {
    fprintf(stderr, "usage: press SCENE.toml [TOP_mm BOTTOM_mm]\n");
    return 2;
  }
  need(hybrid_open(words[1], &options, &session));
  need(hybrid_get_info(session, &info));
  top_m = count == 4 ? atof(words[2]) * 1e-3 : info.high_m[2] + 2.0 * info.tool_radius_m;
  bottom_m = count == 4 ? atof(words[3]) * 1e-3 : 0.5 * (info.low_m[2] + info.high_m[2]);

  at_m[2] = top_m;
  need(hybrid_begin(session, at_m));
  printf("%10s %10s %10s %9s\n", "z mm", "proxy z mm", "force z N", "contacts");
  for (tick = 1; tick <= TICKS; ++tick) {
    at_m[2] = top_m + (bottom_m - top_m) * tick / TICKS;
    need(hybrid_tick(session, at_m, NULL, info.period_s, &felt));
    if (tick % (TICKS / LINES) == 0) {
      printf("%10.3f %10.3f %10.4f %9u\n", 1e3 * felt.device_m[2], 1e3 * felt.proxy_m[2], felt.force_N[2],
             (unsigned)felt.contact_count);
    }
  }
  need(hybrid_save_recording(session, "press.rec"));
  printf("press.rec: `hybrid replay press.rec` plays these %d ticks again\n", TICKS);
  need(hybrid_close(session));
  return 0;
}
