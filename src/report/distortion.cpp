// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "report/result_lists.hpp"

namespace resonid::report {
namespace {

nlohmann::json level_json(const response::DistortionLevel& l) {
  return {{"level", l.level}, {"noise", l.noise}, {"lines", l.lines}, {"significant", l.significant}};
}

response::DistortionLevel read_level(const JsonPlace& j) {
  if (!j.present()) return {};
  return {j.at("lines").count(), j.at("level").not_negative(), j.at("noise").not_negative(),
          j.at("significant").flag()};
}

}  // namespace

nlohmann::json distortion_json(const identification::Distortion& d) {
  nlohmann::json j = nlohmann::json::object();
  if (d.realisations > 0) {
    j["realisations"] = d.realisations;
    j["noise_std"] = d.noise_std;
    j["distortion_std"] = d.distortion_std;
    j["scatter"] = level_json(d.scatter);
  }
  if (d.even.lines > 0) j["detection_lines"]["even"] = level_json(d.even);
  if (d.odd.lines > 0) j["detection_lines"]["odd"] = level_json(d.odd);
  return j;
}

identification::Distortion read_distortion(const JsonPlace& from, std::size_t lines) {
  identification::Distortion d;
  if (const auto realisations = from.maybe("realisations"); realisations.present()) {
    d.realisations = realisations.count();
    const auto read = [&](const char* key, std::vector<double>& target) {
      for (const auto& element : from.at(key).elements()) target.push_back(element.not_negative());
      if (target.size() != lines) from.at(key).refuse("as many numbers as the frequency response has lines");
    };
    read("noise_std", d.noise_std);
    read("distortion_std", d.distortion_std);
    d.scatter = read_level(from.at("scatter"));
  }
  if (const auto silent = from.maybe("detection_lines"); silent.present()) {
    d.even = read_level(silent.maybe("even"));
    d.odd = read_level(silent.maybe("odd"));
  }
  return d;
}

}  // namespace resonid::report
