// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <resonid/base/expected.hpp>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

struct FileSettings {
  std::filesystem::path path;
  Format format = {};
  double poll_s = 0.02;  ///< Between looks at a file that has not grown.
  bool from_start =
      true;  ///< Else what is there when no axis stands in any file and it is started is left out.
};

/// Follows a file that others write, from its beginning (or its end) on, and through its rotation: one that
/// is renamed (to NAME.1, NAME-20260921 and the like in the same folder) is read to its end before the next
/// one, one that is truncated from its beginning. Goes on where its axes' rings stand, also in a file that
/// was renamed meanwhile. Names of CSV columns are those that the newest line of names before that place
/// tells, looked for in the first and the last megabyte before it, else in the files that were renamed. While
/// an intake is full nothing is read.
///
/// Position: device, inode, time of birth (ns; 0 where the file system does not know) plus the number of
/// truncations, byte. The device may have another number after a reboot: it matters only where the time of
/// birth is not known and the file is shorter than that byte.
///
/// Errors: no path; poll_s not > 0.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_file_source(FileSettings settings, Axes& axes);

}  // namespace resonid::monitor
