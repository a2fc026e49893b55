// SPDX-License-Identifier: MIT
/// C interface of resonid (C99): identification of resonating mechanical systems in electric drives.
///
/// All families follow one pattern, with FAMILY for excitation, line_bank, tracker, response, rls, model,
/// physical, change, guard, encoder:
///
///   resonid_FAMILY_config       settings, beginning with their size: callers that were compiled against an
///                               older, shorter struct go on working
///   resonid_FAMILY_defaults()   fills it with defaults
///   resonid_FAMILY_size()       bytes that the handle needs, in the caller's memory ...
///   resonid_FAMILY_init()       ... where this makes it,
///   resonid_FAMILY_create()     or allocated once; resonid_destroy() frees it
///   resonid_FAMILY_step()       one sample: bounded time, no heap, no lock, no system call
///   resonid_FAMILY_reset()      back to the state after init
///   resonid_FAMILY_get_info()   what is known now, in a struct that begins with its size
///
/// Rules for all functions: none throws, prints, aborts, or keeps a pointer that it was given. Arguments that
/// must not be NULL, memory that is no handle of the family and indices out of range give a status. There is
/// no global state but the choice of the instruction set: different handles may be used by different threads
/// at once, one handle by one thread at a time. Not real-time safe are create, destroy and init; size and
/// defaults are, as is all else unless it says so. Frequencies in Hz, SI units throughout, or those of the
/// signals. A sample that is not finite counts as missing, never as an error. docs/c_api.md is the guide.
#ifndef RESONID_C_RESONID_H
#define RESONID_C_RESONID_H

#include <resonid/c/diagnostics.h>
#include <resonid/c/excitation.h>
#include <resonid/c/model.h>
#include <resonid/c/physical.h>
#include <resonid/c/response.h>
#include <resonid/c/rls.h>
#include <resonid/c/safety.h>
#include <resonid/c/tracking.h>
#include <resonid/c/types.h>

#endif
