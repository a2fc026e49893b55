// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace resonid::test {

/// Folder with the real recordings (not part of the project), or an empty path when it is absent: the one
/// that is named, the one that tools/fetch_recordings fills, the one beside the checkout.
inline std::filesystem::path recordings() {
  const char* named = std::getenv("RESONID_RECORDINGS");
  const std::filesystem::path fetched = RESONID_GOLDEN_DIR "/../../recordings";
  const std::filesystem::path beside =
      std::filesystem::is_directory(fetched) ? fetched : RESONID_RECORDINGS_DIR;
  const std::filesystem::path folder = named != nullptr ? named : beside;
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

}  // namespace resonid::test

/// Defines `path` as the recording's file, or skips the test and says why.
#define RESONID_RECORDING_OR_SKIP(path, name)                              \
  const std::filesystem::path path = ::resonid::test::recordings() / name; \
  if (!std::filesystem::exists(path))                                      \
  GTEST_SKIP()                                                             \
      << "recording " << name                                              \
      << " is not here (tools/fetch_recordings fetches it; RESONID_RECORDINGS names another folder)"
