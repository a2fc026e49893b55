// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace resonid::test {

/// Folder with the real recordings (not part of the project), or an empty path when it is absent.
inline std::filesystem::path recordings() {
  const char* named = std::getenv("RESONID_RECORDINGS");
  const std::filesystem::path folder = named != nullptr ? named : RESONID_RECORDINGS_DIR;
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

}  // namespace resonid::test

/// Defines `path` as the recording's file, or skips the test and says why.
#define RESONID_RECORDING_OR_SKIP(path, name)                              \
  const std::filesystem::path path = ::resonid::test::recordings() / name; \
  if (!std::filesystem::exists(path))                                      \
  GTEST_SKIP() << "recording " << name << " is not here (set RESONID_RECORDINGS to the folder that holds it)"
