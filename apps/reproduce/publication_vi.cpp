// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <reproduce/reproduction.hpp>

#include "reproduce/vi_page.hpp"

namespace resonid::reproduction {

report::Document publication_vi(const Options& options) {
  report::Document page;
  page.title =
      "Publication VI: a chirp, one Kalman filter that follows it, and distances in the Nyquist plane";
  page.command = fmt::format("resonid reproduce vi --seeds {}", options.seeds);
  page.seeds = options.seeds;
  page.sections.push_back({"Printed and reproduced at a glance", {}, {}, {}});
  constexpr vi::Part (*kParts[])(const Options&) = {vi::figure_3,  vi::figure_4,  vi::figure_5,
                                                    vi::figure_7,  vi::tensioner, vi::figure_9,
                                                    vi::figure_10, vi::figure_11};
  double done = 0.0;
  for (const auto part : kParts) {
    auto made = part(options);
    auto& head = page.sections.front().tables;
    head.insert(head.end(), made.head.begin(), made.head.end());
    page.sections.push_back(std::move(made.section));
    page.summary.insert(page.summary.end(), made.summary.begin(), made.summary.end());
    done += 1.0;
    if (options.progress) options.progress(done / static_cast<double>(std::size(kParts)));
  }
  page.discrepancies = vi::discrepancies();
  return page;
}

}  // namespace resonid::reproduction
