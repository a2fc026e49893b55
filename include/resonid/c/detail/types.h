// SPDX-License-Identifier: MIT
// The life cycle that all kinds share: version, errors, memory, settings, step, results, snapshots.
#ifndef RESONID_C_TYPES_H
#define RESONID_C_TYPES_H

#include <stddef.h>
#include <stdint.h>

#define RESONID_VERSION_MAJOR 0
#define RESONID_VERSION_MINOR 1
#define RESONID_VERSION_PATCH 0

#define RESONID_API __attribute__((visibility("default")))
#ifdef __cplusplus
#define RESONID_NOEXCEPT noexcept
#define RESONID_BEGIN extern "C" {
#define RESONID_END }
#else
#define RESONID_NOEXCEPT
#define RESONID_BEGIN
#define RESONID_END
#endif

RESONID_BEGIN

typedef struct resonid_complex {
  double re, im;
} resonid_complex;

/// What every function says that can be called wrongly; 0: it was done. Nothing is changed by a call that
/// fails.
typedef int32_t resonid_status;
enum {
  RESONID_OK = 0,
  RESONID_ERROR_NULL = 1,         ///< An argument that must not be NULL is.
  RESONID_ERROR_HANDLE = 2,       ///< The memory holds no handle of this library version.
  RESONID_ERROR_SIZE = 3,         ///< Memory too small, or a struct size that no version of the struct has.
  RESONID_ERROR_ALIGNMENT = 4,    ///< Memory is not aligned to RESONID_ALIGNMENT.
  RESONID_ERROR_SETTINGS = 5,     ///< A field of the settings; resonid_error names it.
  RESONID_ERROR_RANGE = 6,        ///< A line, channel, count or kind that there is not.
  RESONID_ERROR_MEMORY = 7,       ///< resonid_create() got no memory.
  RESONID_ERROR_UNSUPPORTED = 8,  ///< The kind of this handle has no such function or figure.
  RESONID_ERROR_SNAPSHOT = 9,     ///< The snapshot is damaged, or holds what no estimator can hold.
  RESONID_STATUS_COUNT = 10
};

/// Why a call failed. Begin with RESONID_ERROR_INIT; it owns nothing. Functions leave it alone when they
/// succeed.
typedef struct resonid_error {
  uint32_t struct_size;  ///< sizeof(resonid_error); 0 leaves the struct alone.
  resonid_status status;
  double value;           ///< The value found, not a number where it is none.
  char field[64];         ///< Offending field of the settings, or argument; ends with 0.
  char requirement[128];  ///< What is required of it, as a phrase: "must be > 0"; ends with 0.
} resonid_error;
#define RESONID_ERROR_INIT                    \
  {                                           \
    sizeof(resonid_error), 0, 0.0, {0}, { 0 } \
  }

/// Version of the library that runs, which may be newer than these headers: "0.1.0". Valid for as long as the
/// library is loaded. Any thread, real-time safe.
RESONID_API const char* resonid_version(void) RESONID_NOEXCEPT;
/// The same as a number, major * 65536 + minor * 256 + patch. Any thread, real-time safe.
RESONID_API uint32_t resonid_version_number(void) RESONID_NOEXCEPT;

/// The status in words; "unknown status" for any other number. Any thread, real-time safe.
RESONID_API const char* resonid_status_string(resonid_status status) RESONID_NOEXCEPT;

// ---- Kinds ----

/// What a handle is of, 256 * family + type; part of snapshots, so the numbers stay. A family shares one
/// struct of settings and one of results, which bear its name.
enum {
  RESONID_PRBS = 0x0100,  ///< Family excitation, excitation.h.
  RESONID_MULTISINE = 0x0101,
  RESONID_CHIRP = 0x0102,
  RESONID_STEPPED_SINE = 0x0103,
  RESONID_LINE_BANK = 0x0200,      ///< lines.h.
  RESONID_KALMAN_BANK = 0x0300,    ///< Family tracker: several fixed lines of one signal, however close.
  RESONID_SLIDING_DFT = 0x0301,    ///< Fixed lines on the grid sample_rate_hz/window_samples, over a window.
  RESONID_CHIRP_TRACKER = 0x0302,  ///< One line, which follows a chirp.
  RESONID_RESPONSE = 0x0400,
  RESONID_RLS = 0x0500,          ///< models.h.
  RESONID_ARX = 0x0600,          ///< Family model. Least squares: biased by output noise. Orders 1 ... 6.
  RESONID_OE = 0x0601,           ///< Output error along the regressor (RPLR). Orders 1 ... 5.
  RESONID_OE_FILTERED = 0x0602,  ///< Output error, the regressor filtered by 1/A (RPEM). Orders 1 ... 5.
  RESONID_CLOE = 0x0603,         ///< Closed-loop output error: needs ru, controller. Orders 1 ... 6.
  RESONID_F_CLOE = 0x0604,       ///< The same, filtered by S/A of the start model, which must be given.
  RESONID_CLOE_DAMPED = 0x0605,  ///< The same, filtered by 1/A of the current model: the most accurate.
  RESONID_IV = 0x0606,           ///< Instrumental variables: ru, controller, start model. Orders 2 ... 5.
  RESONID_PHYSICAL = 0x0700,
  RESONID_CUSUM = 0x0800,             ///< Family change, supervision.h.
  RESONID_LIKELIHOOD_RATIO = 0x0801,  ///< For a change of any size.
  RESONID_GUARD = 0x0900,             ///< excitation.h.
  RESONID_ENCODER_COUNTER = 0x0a00,   ///< Family encoder, lines.h: register of a quadrature decoder.
  RESONID_ENCODER_ABSOLUTE = 0x0a01,  ///< 0 ... counts_per_turn - 1 within one turn, right from the first.
  RESONID_AXIS_ARX = 0x0b00,          ///< Family axis, axis.h, by what follows the machine; orders 1 and 3.
  RESONID_AXIS_OE = 0x0b01,           ///< Order 3, like all up to _CLOE_DAMPED.
  RESONID_AXIS_OE_FILTERED = 0x0b02,
  RESONID_AXIS_CLOE = 0x0b03,
  RESONID_AXIS_F_CLOE = 0x0b04,
  RESONID_AXIS_CLOE_DAMPED = 0x0b05,
  RESONID_AXIS_IV = 0x0b06,  ///< Orders 1 and 3.
  RESONID_AXIS_PHYSICAL = 0x0b07,
  RESONID_AXIS_LINES = 0x0b08,
  RESONID_AXIS_SLIDING_DFT = 0x0b09,
  RESONID_AXIS_CHIRP = 0x0b0a,
  RESONID_CONTROL = 0x0c00  ///< control.h.
};

/// Settings of every kind begin with this.
typedef struct resonid_settings {
  uint32_t struct_size;  ///< Bytes of the whole struct; set by resonid_defaults().
  uint32_t kind;         ///< RESONID_PRBS ...; set by resonid_defaults().
} resonid_settings;

/// Results of every kind begin with this.
typedef struct resonid_results {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t kind;         ///< Kind of the handle.
} resonid_results;

// ---- Memory ----

/// A handle of any kind: one block of memory of fixed size that points nowhere, a header and behind it the
/// estimator.
typedef struct resonid_handle resonid_handle;

#define RESONID_ALIGNMENT 64

/// Memory for a handle as a variable, say static: RESONID_MEMORY(memory, 4096);
#define RESONID_MEMORY(name, bytes) unsigned char name[bytes] __attribute__((aligned(RESONID_ALIGNMENT)))

/// Fills settings of `struct_size` = sizeof(whole struct) bytes with the defaults of a kind:
/// resonid_defaults(&settings.head, sizeof settings, RESONID_RLS). RESONID_ERROR_RANGE: no such kind.
RESONID_API resonid_status resonid_defaults(resonid_settings* settings, size_t struct_size,
                                            uint32_t kind) RESONID_NOEXCEPT;
/// Bytes that a handle of these settings needs; 0: there is no such handle.
RESONID_API size_t resonid_size(const resonid_settings* settings) RESONID_NOEXCEPT;
/// Makes the estimator in the caller's memory of `size` bytes, aligned to RESONID_ALIGNMENT; *handle is then
/// the same address. Arrays that the settings point to are read now, and never again. `error` may be NULL.
/// RESONID_ERROR_SETTINGS, _SIZE, _ALIGNMENT, _NULL, _RANGE (no such kind).
RESONID_API resonid_status resonid_init(void* memory, size_t size, const resonid_settings* settings,
                                        resonid_handle** handle, resonid_error* error) RESONID_NOEXCEPT;
/// The same in memory from the heap, for resonid_destroy(). RESONID_ERROR_MEMORY as well.
RESONID_API resonid_status resonid_create(const resonid_settings* settings, resonid_handle** handle,
                                          resonid_error* error) RESONID_NOEXCEPT;
/// Frees what resonid_create() made, and nothing else (NULL: nothing to do). Memory that the caller gave to
/// resonid_init() needs no such call. Not real-time safe.
RESONID_API void resonid_destroy(resonid_handle* handle) RESONID_NOEXCEPT;
/// Kind of a handle, 0 when there is none at this address. Real-time safe.
RESONID_API uint32_t resonid_kind(const resonid_handle* handle) RESONID_NOEXCEPT;
/// Size in bytes of a handle, 0 when there is none at this address. Real-time safe.
RESONID_API size_t resonid_handle_size(const resonid_handle* handle) RESONID_NOEXCEPT;

// ---- Samples ----

/// One sample of excitation ru, input u and output y, for all kinds that estimate from them: line bank,
/// response, models, physical, and trackers, whose signal is y. What a kind does not use is ignored; what is
/// not finite makes the sample a missing one. Real-time safe. RESONID_ERROR_UNSUPPORTED: the kind has a
/// step of its own, such as resonid_guard_step().
RESONID_API resonid_status resonid_step(resonid_handle* handle, double ru, double u,
                                        double y) RESONID_NOEXCEPT;
/// `count` samples at once, [sample]. `ru` may be NULL, which is 0, but for a line bank of three channels;
/// `u` for a tracker.
RESONID_API resonid_status resonid_run(resonid_handle* handle, const double* ru, const double* u,
                                       const double* y, size_t count) RESONID_NOEXCEPT;
/// The same from single-precision signals; the estimator's own precision stays.
RESONID_API resonid_status resonid_run_float(resonid_handle* handle, const float* ru, const float* u,
                                             const float* y, size_t count) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Of a guard: they went by without a step,
/// and the ramps wait. Of an encoder: the next difference is spread over them. Real-time safe.
RESONID_API resonid_status resonid_miss(resonid_handle* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_reset(resonid_handle* handle) RESONID_NOEXCEPT;

// ---- Results ----

/// What is known now: fills the first `struct_size` bytes of the results of the family of `kind`, so
/// resonid_read(handle, RESONID_RLS, &results.head, sizeof results). Real-time safe.
/// RESONID_ERROR_UNSUPPORTED: the handle is of another family.
RESONID_API resonid_status resonid_read(const resonid_handle* handle, uint32_t kind, resonid_results* results,
                                        size_t struct_size) RESONID_NOEXCEPT;

// ---- Snapshots ----

/// Writes a snapshot of the handle, resonid_handle_size() bytes with a header and a checksum, to any address.
/// A servo thread may copy the handle's bytes by memcpy and leave this to another thread, which needs the
/// copy aligned to RESONID_ALIGNMENT. Takes some 1 ns per byte.
RESONID_API resonid_status resonid_snapshot(const resonid_handle* handle, void* snapshot, size_t size,
                                            resonid_error* error) RESONID_NOEXCEPT;
/// Whether the bytes, at any address, are an undamaged snapshot of a handle of the kind (0: of any), by this
/// version of the library.
RESONID_API resonid_status resonid_check(const void* snapshot, size_t size, uint32_t kind,
                                         resonid_error* error) RESONID_NOEXCEPT;
/// Makes the handle of a snapshot in `memory` (of at least as many bytes, aligned); it continues bit for bit,
/// in this process or another one. Refused unless resonid_check() holds; RESONID_ERROR_SNAPSHOT also where
/// the checksum is right but the state is none that an estimator can be in, and only then `memory` has
/// changed: it holds no handle. Takes no heap; some 2 ns per byte.
RESONID_API resonid_status resonid_restore(void* memory, size_t memory_size, const void* snapshot,
                                           size_t snapshot_size, uint32_t kind, resonid_handle** handle,
                                           resonid_error* error) RESONID_NOEXCEPT;

// ---- Numbers that several families share ----

/// How trackers weigh what they have against the newest sample.
enum {
  RESONID_GAIN_FIXED = 0,        ///< By `lambda`.
  RESONID_GAIN_PLACED_POLES = 1  ///< By `pole_radius`.
};

/// How a chirp sweeps.
enum { RESONID_SWEEP_LINEAR = 0, RESONID_SWEEP_LOGARITHMIC = 1 };

/// What an estimator computes in, where there is a choice.
enum { RESONID_DOUBLE = 0, RESONID_FLOAT = 1 };

RESONID_END

#endif
