// SPDX-License-Identifier: MIT
#include "result_file.hpp"

#include <algorithm>
#include <limits>
#include <resonid/base/error_text.hpp>
#include <resonid/io/csv.hpp>
#include <vector>

#include "errors.hpp"
#include "output.hpp"
#include "stored_result.hpp"

namespace resonid::cli {

identification::Result read_result(const std::string& path, const std::string& option) {
  auto result = stored_result(path);
  if (!result) throw InputError((option.empty() ? "" : option + ": ") + message_of(result.error()));
  return std::move(*result);
}

void write_response(const std::string& path, const identification::Result& result) {
  std::vector<io::ResponseColumn> columns;
  if (result.distortion && result.distortion->realisations > 0)
    columns = {{"noise_std", result.distortion->noise_std},
               {"distortion_std", result.distortion->distortion_std}};
  if (const auto& second = result.second_output) {  // on the output's lines; not a number where it has none
    const auto& g = second->response;
    const auto column = [&](auto&& of) {
      std::vector<double> values;
      for (const double f : result.response.frequency_hz) {
        const auto at = std::lower_bound(g.frequency_hz.begin(), g.frequency_hz.end(), f);
        const bool there = at != g.frequency_hz.end() && *at == f;
        values.push_back(there ? of(static_cast<std::size_t>(at - g.frequency_hz.begin()))
                               : std::numeric_limits<double>::quiet_NaN());
      }
      return values;
    };
    columns.push_back({"load_real", column([&](std::size_t i) { return g.value[i].real(); })});
    columns.push_back({"load_imag", column([&](std::size_t i) { return g.value[i].imag(); })});
    columns.push_back({"load_std", column([&](std::size_t i) { return g.std[i]; })});
    columns.push_back({"load_coherence", column([&](std::size_t i) { return g.coherence[i]; })});
  }
  write_output(path, io::response_csv(result.response, columns));
}

}  // namespace resonid::cli
