// SPDX-License-Identifier: MIT
// What every part of the C interface uses: version, status, errors, and the memory of handles.
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
  RESONID_ERROR_HANDLE = 2,       ///< The memory holds no handle of this family and library version.
  RESONID_ERROR_SIZE = 3,         ///< Memory too small, or a struct size that no version of the struct has.
  RESONID_ERROR_ALIGNMENT = 4,    ///< Memory is not aligned to RESONID_ALIGNMENT.
  RESONID_ERROR_CONFIG = 5,       ///< A field of the configuration; resonid_error names it.
  RESONID_ERROR_RANGE = 6,        ///< A line, channel or count that there is not.
  RESONID_ERROR_MEMORY = 7,       ///< create() got no memory.
  RESONID_ERROR_UNSUPPORTED = 8,  ///< This kind of estimator has no such figure.
  RESONID_STATUS_COUNT = 9
};

/// Why a call failed. Begin with RESONID_ERROR_INIT; it owns nothing. Functions leave it alone when they
/// succeed.
typedef struct resonid_error {
  uint32_t struct_size;  ///< sizeof(resonid_error); 0 leaves the struct alone.
  resonid_status status;
  double value;           ///< The value found, not a number where it is none.
  char field[64];         ///< Offending field of the configuration, or argument; ends with 0.
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

/// A handle is one block of memory of fixed size that points nowhere: a header, which tells family, version
/// and size, and behind it the estimator. A copy of its bytes is a snapshot.
#define RESONID_ALIGNMENT 64

/// Memory for a handle as a variable, say static: RESONID_MEMORY(memory, 4096);
#define RESONID_MEMORY(name, bytes) unsigned char name[bytes] __attribute__((aligned(RESONID_ALIGNMENT)))

/// What a handle is of; part of snapshots, so the numbers stay.
enum {
  RESONID_FAMILY_EXCITATION = 1,
  RESONID_FAMILY_LINE_BANK = 2,
  RESONID_FAMILY_TRACKER = 3,
  RESONID_FAMILY_RESPONSE = 4,
  RESONID_FAMILY_RLS = 5,
  RESONID_FAMILY_MODEL = 6,
  RESONID_FAMILY_PHYSICAL = 7,
  RESONID_FAMILY_CHANGE = 8,
  RESONID_FAMILY_GUARD = 9,
  RESONID_FAMILY_ENCODER = 10
};

/// Size in bytes of a handle, 0 when there is none at this address: so many a snapshot takes, by memcpy.
/// Real-time safe.
RESONID_API size_t resonid_handle_size(const void* handle) RESONID_NOEXCEPT;

/// Whether `memory` holds a handle of the family, made by this version of the library, in all its `size`
/// bytes. What the bytes behind the header say is not checked. Real-time safe.
RESONID_API resonid_status resonid_check(const void* memory, size_t size, uint32_t family,
                                         resonid_error* error) RESONID_NOEXCEPT;

/// Copies a snapshot into `memory` (of at least as many bytes, aligned), which is a handle of the family from
/// then on and continues bit for bit, in this process or another one. Refused unless resonid_check() holds
/// for the snapshot, which need not be aligned. Real-time safe.
RESONID_API resonid_status resonid_restore(void* memory, size_t memory_size, const void* snapshot,
                                           size_t snapshot_size, uint32_t family,
                                           resonid_error* error) RESONID_NOEXCEPT;

/// Frees what a resonid_..._create() made, and nothing else (NULL: nothing to do). Memory that the caller
/// gave to resonid_..._init() needs no such call. Not real-time safe.
RESONID_API void resonid_destroy(void* handle) RESONID_NOEXCEPT;

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
