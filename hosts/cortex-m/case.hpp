// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// One sample of the record that every case is fed with (record.hpp).
struct Sample {
  float ru = 0.0F, u = 0.0F, y = 0.0F;
};

enum class Injection { none, multisine, chirp, prbs };

/// Writes results as hexadecimal bits, so that nothing is lost and no printf is needed.
class Output {
 public:
  /// `values` belong together: they are compared with the host's relative to the largest of them.
  void floats(const char* name, std::span<const float> values);
  void number(const char* name, std::uint32_t value);

 private:
  void hex(std::uint32_t bits);
};

/// One estimator as it is measured and compared: its own object, and what is done with it.
struct Case {
  const char* name;
  Injection injection;          ///< What excites the drive of its record.
  std::size_t state_bytes;      ///< Size of the estimator.
  bool (*create)();             ///< Makes it; false when the configuration was refused.
  void (*step)(const Sample&);  ///< One sample, with whatever result is wanted at every sample.
  void (*report)(Output&);      ///< Results so far.
};

/// Runs the case over its record; the exit code of the program.
int run(const Case& c);
