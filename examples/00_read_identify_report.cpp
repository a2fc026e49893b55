// SPDX-License-Identifier: MIT
#include <iostream>
#include <resonid/resonid.hpp>  // find_package(resonid); target_link_libraries(app resonid::resonid)

int main() {
  const auto record = resonid::read_record("run.csv").value();
  const auto result =
      resonid::identify(record, {.controller = resonid::pi(1.036, 0.147), .delay_s = 0.004}).value();
  for (const auto& mode : result.modes)  // "resonance 15.112 Hz +- 0.0158", one standard deviation
    std::cout << mode.name() << ' ' << mode.frequency_hz.value << " Hz +- " << mode.frequency_hz.std << '\n';
  resonid::write_report("report.html", result, record).value();
}
