// SPDX-License-Identifier: MIT
/// C interface of resonid (C99): identification of resonating mechanical systems in electric drives.
///
/// All families follow one pattern, with XXX for excitation, line_bank, tracker, response, rls, model,
/// physical, change, guard, encoder:
///
///   resonid_XXX_config          settings; the first field holds the struct's size, so that callers which
///   were
///                               compiled against an older, shorter struct go on working
///   resonid_XXX_defaults()      fills it with defaults
///   resonid_XXX_size()          bytes that the handle needs, in the caller's memory ...
///   resonid_XXX_init()          ... where this makes it,
///   resonid_XXX_create()        or allocated once; resonid_destroy() frees it
///   resonid_XXX_step()          one sample: bounded time, no heap, no lock, no system call
///   resonid_XXX_reset()         back to the state after init
///   resonid_XXX_get_info()      what is known now, in a struct that begins with its size
///
/// Rules for all functions: none throws, prints, aborts, or keeps a pointer that it was given. Arguments that
/// must not be NULL, memory that is no handle of the family and indices out of range give a status. There is
/// no global state: different handles may be used by different threads at once, one handle by one thread at a
/// time. Not real-time safe are create, destroy and init; size and defaults are, as is all else unless it
/// says so. Frequencies in Hz, SI units throughout, or those of the signals. A sample that is not finite
/// counts as missing, never as an error. docs/c_api.md is the guide.
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
