// SPDX-License-Identifier: GPL-3.0-or-later
/* The C interface of hybrid, a haptic renderer for scenes of rigid and soft objects.
 *
 * Units are SI: meters, newtons, seconds. Positions, forces and surfaces are in the scene's frame.
 * Quaternions are (w, x, y, z). Texts are UTF-8.
 *
 * Every function returns a code. After a failure hybrid_error_text() says what was wrong, where, and what to
 * do. No function throws, and none ends the program. A call that fails has no effect, if its comment does not
 * say otherwise.
 *
 * Threads. The functions of a session belong to one of four groups, marked in the comments below:
 *   [servo]  the thread that calls the ticks; one call at a time
 *   [reader] the thread that draws; one call at a time, while another thread may tick
 *   [editor] the thread that edits values; one call at a time, while other threads may tick and read
 *   [any]    any thread, between hybrid_open() and hybrid_close()
 * One thread may do everything. Two calls of one group at the same time are refused (HYBRID_BUSY). Different
 * sessions are independent of one another.
 *
 * Structures begin with their size, which the caller sets: later versions append members. Zero is the default
 * of every option, so `hybrid_options options = {.size = sizeof options};` has all defaults.
 */
#ifndef HYBRID_H
#define HYBRID_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this header. A library is compatible if hybrid_abi_version() returns the same number. */
#define HYBRID_ABI_VERSION 2

typedef enum hybrid_code {
  HYBRID_OK = 0,
  HYBRID_NULL_ARGUMENT = 1,  /* a pointer that is needed is NULL */
  HYBRID_CLOSED = 2,         /* the session was closed */
  HYBRID_WRONG_ORDER = 3,    /* another call has to come first */
  HYBRID_BUSY = 4,           /* another thread is in a call of the same group */
  HYBRID_BAD_VALUE = 5,      /* a number is not finite or out of range */
  HYBRID_BAD_STRUCT = 6,     /* the size of a structure was not set */
  HYBRID_NOT_FOUND = 7,      /* no object or quantity has this name or number */
  HYBRID_TOO_SMALL = 8,      /* the caller's buffer is too small; the text says which size is needed */
  HYBRID_FULL = 9,           /* a queue or a recording is full */
  HYBRID_REFUSED = 10,       /* the scene is refused; the text has file, line and remedy */
  HYBRID_NOT_AVAILABLE = 11, /* not possible in this session; the text says why */
  HYBRID_FILE = 12,          /* a file cannot be written */
  HYBRID_NO_MEMORY = 13,
  HYBRID_INTERNAL = 14 /* an error of this library; please report it with its text */
} hybrid_code;

typedef struct hybrid_session hybrid_session; /* opaque */

/* ---- the library ----------------------------------------------------------------------------------------
 */

/* [any] The version as "major.minor.patch"; never NULL. */
const char* hybrid_version(void);
/* [any] HYBRID_ABI_VERSION of the library that is loaded. */
uint32_t hybrid_abi_version(void);
/* [any] What was wrong in the last call of this thread that failed, where, and what to do. Never NULL; empty
 * if none failed yet. Valid until the next failure or the next call of this function in this thread. */
const char* hybrid_error_text(void);
/* [any] The name of a code, such as "HYBRID_BUSY"; "unknown code" for other numbers. */
const char* hybrid_code_name(hybrid_code code);

/* ---- opening and closing --------------------------------------------------------------------------------
 */

/* How tissue away from the contact relaxes. */
typedef enum hybrid_relaxation {
  /* As in `hybrid run`: on the servo thread, within hybrid_tick(), outside the time that tick_us counts. The
   * same inputs give the same bits. For sessions that are not in real time. */
  HYBRID_RELAX_IN_CALL = 0,
  /* On a thread of its own. For real time. The result depends on the machine; a recording replays exactly. */
  HYBRID_RELAX_THREAD = 1,
  /* In the tick, by the budget of the scene. The same inputs give the same bits. */
  HYBRID_RELAX_TICK = 2
} hybrid_relaxation;

typedef struct hybrid_options {
  uint32_t size;       /* sizeof(hybrid_options) */
  uint32_t relaxation; /* a hybrid_relaxation */
  double rate_hz;      /* servo rate, 100 to 20000; 0: that of the scene. The period is 1 / rate */
  /* Ticks that hybrid_save_recording() and hybrid_measure_error() can cover: 48 and 56 bytes each, allocated
   * by hybrid_begin(). 0: none. */
  uint64_t recorded_ticks;
  double surfaces_hz;        /* with HYBRID_RELAX_THREAD: rate of new surfaces; 0: 30 */
  uint32_t without_surfaces; /* not 0: no memory for hybrid_publish() and hybrid_vertices() */
  uint32_t with_error;       /* not 0: hybrid_measure_error() may be called; doubles the memory of tissue */
} hybrid_options;

/* [any] Opens the scene of a file. `options` may be NULL. Takes as long as `hybrid check`. On failure
 * *session is NULL. The simulated device, hand and path of the scene have no effect: the caller moves the
 * tool. The force limits of the scene and of its device hold. */
hybrid_code hybrid_open(const char* scene_file, const hybrid_options* options, hybrid_session** session);
/* [any] Opens a scene from its text. `folder`: the files that the scene names are relative to it. Errors name
 * the file "<text>". */
hybrid_code hybrid_open_text(const char* scene_text, const char* folder, const hybrid_options* options,
                             hybrid_session** session);
/* Frees the session. Call it when no other thread uses the session. Later calls with the handle return
 * HYBRID_CLOSED. A call while another thread is within the session returns HYBRID_BUSY. */
hybrid_code hybrid_close(hybrid_session* session);

/* ---- the scene ------------------------------------------------------------------------------------------
 */

typedef struct hybrid_info {
  uint32_t size;    /* sizeof(hybrid_info) */
  uint32_t objects; /* numbered from 0: rigid ones first */
  uint32_t rigid_objects;
  uint32_t notes;    /* of hybrid_note() */
  uint32_t editable; /* of hybrid_editable_value() */
  uint32_t is_punch; /* the tool: 0 a ball, 1 a flat punch along z */
  double tool_radius_m;
  double period_s;            /* 1 / rate */
  double max_force_N;         /* limit of the force on the hand */
  double low_m[3], high_m[3]; /* box around all objects at rest */
} hybrid_info;

typedef struct hybrid_object {
  uint32_t size;                /* sizeof(hybrid_object) */
  uint32_t is_soft;             /* 0: rigid */
  const char* name;             /* valid until the session is closed */
  uint64_t vertices, triangles; /* of its surface; 0 with without_surfaces */
} hybrid_object;

/* [any] */
hybrid_code hybrid_get_info(hybrid_session* session, hybrid_info* info);
/* [any] */
hybrid_code hybrid_get_object(hybrid_session* session, uint32_t object, hybrid_object* out);
/* [any] Note number `note` of the build, as `hybrid check` prints it. Valid until the session is closed. */
hybrid_code hybrid_note(hybrid_session* session, uint32_t note, const char** text);

/* ---- ticks ----------------------------------------------------------------------------------------------
 */

typedef struct hybrid_felt {
  uint32_t size;          /* sizeof(hybrid_felt) */
  uint32_t contact_count; /* number of objects in contact; 0: no contact */
  uint32_t contact_bits;  /* bit n: object n; all objects from the 32nd on share the last bit */
  uint32_t faults;        /* bits of hybrid_fault_text(), of the whole session */
  double device_m[3];     /* the position that was used */
  double proxy_m[3];      /* the proxy, outside everything rigid */
  double force_N[3];      /* on the hand, after the limits */
  double rigid_N[3];      /* parts of the force before the limits: of rigid objects, */
  double soft_N[3];       /* and of soft ones */
  double tick_us;         /* processor time of the tick (us) */
  uint64_t tick;          /* number of ticks before this one */
  uint64_t hash;          /* of all forces so far; equal sessions have equal hashes */
} hybrid_felt;

/* [servo] Starts the session with the tool at a position, which must not be inside anything rigid
 * (HYBRID_REFUSED; another position may be tried). Call it once, before the first tick. Allocates. */
hybrid_code hybrid_begin(hybrid_session* session, const double position_m[3]);

/* [servo] One tick with the tool at a position. Allocates nothing, takes no lock, waits for nothing.
 * `orientation_wxyz`: NULL or a unit quaternion. It is checked, and has no effect: a ball and a punch along z
 * do not turn. `dt_s`: time since the tick before, above 0 to 0.1 s; a recording needs info.period_s.
 * `felt`: may be NULL. */
hybrid_code hybrid_tick(hybrid_session* session, const double position_m[3], const double orientation_wxyz[4],
                        double dt_s, hybrid_felt* felt);

/* [servo] `count` ticks along positions (x, y, z for each), each as hybrid_tick(). `felt`: NULL, or `count`
 * results; felt[0].size must be set. No tick is done if a position is not finite. */
hybrid_code hybrid_play(hybrid_session* session, const double* positions_m, size_t count, double dt_s,
                        hybrid_felt* felt);

/* [servo] The last result again. HYBRID_WRONG_ORDER before the first tick. */
hybrid_code hybrid_get_felt(hybrid_session* session, hybrid_felt* felt);
/* [servo] One object's part of the force (N) in the last tick, and whether it is in contact. The parts of all
 * objects sum up to the force before its limits. `in_contact` may be NULL. */
hybrid_code hybrid_object_force(hybrid_session* session, uint32_t object, double force_N[3], int* in_contact);
/* [servo] The hash of forces and of the whole state, as `state_hash` of `hybrid run`. Reads every displaced
 * voxel: not for every tick. */
hybrid_code hybrid_state_hash(hybrid_session* session, uint64_t* hash);
/* [any] The text of the lowest fault bit that is set, with its remedy; "" if none is. Valid for ever. */
const char* hybrid_fault_text(uint32_t faults);

/* ---- edits while the session runs -----------------------------------------------------------------------
 */

typedef struct hybrid_editable {
  uint32_t size;        /* sizeof(hybrid_editable) */
  const char* object;   /* NULL: the tool */
  const char* quantity; /* "stiffness" (N/m) and "max-force" (N) of the tool; of rigid objects
                         * "static-friction", "dynamic-friction", "damping" (N s/m), "texture-height" (m),
                         * and "stiffness" if the scene gives the object one; of soft ones "tissue-factor", a
                         * factor on Young's modulus */
  double in_scene;      /* value of the scene, SI */
  double low, high;     /* allowed values, SI */
} hybrid_editable;

/* [any] Editable value number `index` of info.editable. */
hybrid_code hybrid_editable_value(hybrid_session* session, uint32_t index, hybrid_editable* out);
/* [editor] Sets a value before the next tick. `object`: NULL for the tool. HYBRID_FULL if 256 edits wait, or
 * if the session has had 100,000. An edit is part of a recording. */
hybrid_code hybrid_edit(hybrid_session* session, const char* object, const char* quantity, double value);

/* ---- surfaces -------------------------------------------------------------------------------------------
 */

typedef struct hybrid_snapshot {
  uint32_t size;     /* sizeof(hybrid_snapshot) */
  uint32_t is_fresh; /* 1: published since the call before */
  uint64_t tick;     /* ticks done when it was published */
  double device_m[3], proxy_m[3], force_N[3];
} hybrid_snapshot;

/* [servo] Hands the present surfaces to the reader. Waits for nothing; may allocate. Call it between ticks,
 * as often as pictures are drawn: the time grows with the surfaces of soft objects. */
hybrid_code hybrid_publish(hybrid_session* session);
/* [reader] Takes the newest published surfaces. Until the first one all surfaces are at rest. */
hybrid_code hybrid_take_snapshot(hybrid_session* session, hybrid_snapshot* out);
/* [reader] Vertices (m) of an object's surface in the snapshot that was taken last: x, y, z for each.
 * `capacity`: vertices that fit. `changed` may be NULL; 1: the surface moved with that snapshot. With
 * vertices_m = NULL only `changed` is set. */
hybrid_code hybrid_vertices(hybrid_session* session, uint32_t object, double* vertices_m, size_t capacity,
                            int* changed);
/* [any] Triangles of an object's surface, three indices of vertices each; they never change. `capacity`:
 * triangles that fit. */
hybrid_code hybrid_triangles(hybrid_session* session, uint32_t object, uint32_t* indices, size_t capacity);

/* ---- recordings and errors ------------------------------------------------------------------------------
 */

/* [servo] Writes the session so far: `hybrid replay FILE` plays it to the same hash. Needs recorded_ticks,
 * and dt_s = info.period_s in every tick. A scene from a file has to stay as it is. */
hybrid_code hybrid_save_recording(hybrid_session* session, const char* file);

typedef struct hybrid_error {
  uint32_t size;    /* sizeof(hybrid_error) */
  uint32_t samples; /* ticks that were compared */
  double max_N, rms_N;
  double max_jnd, p99_jnd;              /* unit: just noticeable difference, the larger of 7 % and 0.04 N */
  double moving_max_jnd, still_max_jnd; /* while the device moves, and while it is still */
} hybrid_error;

/* [servo] The error of the tissue's force so far, as `hybrid run` reports it. The reference is the same
 * motion, five times slower, and ten times slower while the device is still. Takes about twice as long as the
 * session. Compares every tick in which something soft was in contact. Needs with_error and recorded_ticks;
 * HYBRID_NOT_AVAILABLE if nothing can be compared. */
hybrid_code hybrid_measure_error(hybrid_session* session, hybrid_error* out);

#ifdef __cplusplus
}
#endif
#endif
