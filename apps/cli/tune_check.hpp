// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <string_view>

#include "record_options.hpp"

namespace resonid::cli {

/// `tune --check RECORD`: the recording under the controller, and how it is identified.
struct TuneCheck {
  RecordOptions record;
  MethodOptions method;
  bool told_excitation = false, told_second_output = false;  ///< Columns named by the call, not by a result.

  [[nodiscard]] bool is_wanted() const { return !record.record.empty(); }
};

/// --check, and of the options of identify those that describe recording and drive.
void add_check_options(CLI::App& verb, TuneCheck& check);

/// Takes over what has an effect of the options of a result: the controller that ran and, for the recording
/// of
/// --check, what describes signals and drive and how it is identified. The loop's own (delay, approach) come
/// from elsewhere, and a band or a stretch is of one recording.
void inherit_for_tune(CLI::App& verb, TuneCheck& check, const identification::Result& result,
                      const std::string& file);

/// The recording under the new controller, identified as `designed_for` was. Its excitation is what it tells;
/// what the result stores of it is taken where it tells none.
[[nodiscard]] identification::Result identified_for_check(CLI::App& verb, TuneCheck& check,
                                                          const identification::Result& designed_for,
                                                          const std::string& file,
                                                          const data::TransferFunction& controller,
                                                          std::function<void(std::string_view)> progress);

}  // namespace resonid::cli
