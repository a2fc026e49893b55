// SPDX-License-Identifier: MIT
/// C interface of resonid (C99): identification of resonating mechanical systems in electric drives.
///
/// Every kind of generator, estimator and supervisor (RESONID_PRBS ... in detail/types.h) has one life cycle:
///
///   resonid_FAMILY_settings     beginning with their size and kind: callers that were compiled against an
///                               older, shorter struct go on working
///   resonid_defaults()          fills them with the defaults of a kind
///   resonid_size()              bytes that the handle needs, in the caller's memory ...
///   resonid_init()              ... where this makes it,
///   resonid_create()            or allocated once; resonid_destroy() frees it
///   resonid_step(), _run()      samples: bounded time, no heap, no lock, no system call
///   resonid_miss(), _reset()    lost samples; back to the state after init
///   resonid_read()              what is known now, in a resonid_FAMILY_results that begins with its size
///   resonid_snapshot()          ..., checked by resonid_restore(), which continues it
///
/// A generator is read by resonid_generate(); guard, encoder, least squares, change detection and control,
/// whose samples are not ru, u, y, have a step that bears their name; so has an axis, which says when a row
/// is done.
///
/// Rules for all functions: none throws, prints, aborts, or keeps a pointer that it was given. Arguments that
/// must not be NULL, memory that is no handle, handles of another kind and indices out of range give a
/// status. There is no global state but the choice of the instruction set: different handles may be used by
/// different threads at once, one handle by one thread at a time. Not real-time safe are create, destroy,
/// init, snapshot and restore; size and defaults are, as is all else unless it says so. Frequencies in Hz, SI
/// units throughout, or those of the signals. A sample that is not finite counts as missing, never as an
/// error. docs/c_api.md is the guide.
#ifndef RESONID_C_RESONID_H
#define RESONID_C_RESONID_H

#include <resonid/c/detail/axis.h>
#include <resonid/c/detail/control.h>
#include <resonid/c/detail/excitation.h>
#include <resonid/c/detail/lines.h>
#include <resonid/c/detail/models.h>
#include <resonid/c/detail/supervision.h>
#include <resonid/c/detail/types.h>

#endif
