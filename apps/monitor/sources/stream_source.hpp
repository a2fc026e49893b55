// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

struct StreamSettings {
  Format format = {};
  int descriptor = 0;  ///< Standard input; stays open when the source ends.
};

/// Reads a pipe until it is closed. While an intake is full nothing is read, so that the writer waits. Where
/// it is stopped the next source of this process on the same descriptor goes on: with the names of columns,
/// half a message, and what was read and not taken.
///
/// Errors: a descriptor that is negative.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_stream_source(StreamSettings settings,
                                                                          Axes& axes);

}  // namespace resonid::monitor
