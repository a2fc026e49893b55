// SPDX-License-Identifier: MIT
// Figure 11: the plant from Y/Ru and the known controller against Y/U.
#include <fmt/format.h>

#include <resonid/io/shipped_experiments.hpp>

#include "reproduce/vi_offline.hpp"
#include "reproduce/vi_page.hpp"

namespace resonid::reproduction::vi {
namespace {

using Mark = report::Curve::Mark;

}  // namespace

Part figure_11(const Options& options) {
  Part part;
  part.section.title = "Figure 11: indirect against direct";
  part.section.text = {
      "System A, lambda = 8. Indirect: G = Gcl/(1 - C Gcl) with Gcl = Y/Ru and the known controller (eq. "
      "5). Since the filter is locked to the excitation, Y/U is the ratio of two averages over it, not a "
      "spectral ratio with its bias under feedback: both ways agree."};
  const auto experiment = io::shipped_experiment("vi_chirp_a");
  const Known given = known(experiment);
  const auto grid = band_grid_hz();
  const auto truth = true_response(experiment, grid);
  struct Way {
    const char* name;
    Approach approach;
  };
  constexpr Way kWays[] = {{"direct", Approach::direct}, {"indirect", Approach::indirect}};
  const TrackedSweep clean(run_without_noise(experiment), given, 8.0);
  std::vector<TrackedSweep> noisy;
  for (std::size_t seed = 1; seed <= options.seeds; ++seed)
    noisy.emplace_back(run(experiment, seed), given, 8.0);

  std::vector<Named> with_noise{{"true", truth, Mark::line}};
  std::vector<Named> without_noise = with_noise;
  for (const auto& way : kWays) {
    report::ComparisonTable table;
    table.title = fmt::format("System A, {}: error of the published estimator", way.name);
    add_noise_free_rows(table, way.name, errors(clean.response(grid, way.approach), truth));
    std::vector<ResponseErrors> runs;
    for (const auto& tracked : noisy) runs.push_back(errors(tracked.response(grid, way.approach), truth));
    add_noisy_rows(table, way.name, runs);
    part.section.tables.push_back(std::move(table));
    with_noise.push_back({way.name, noisy.front().response(grid, way.approach), Mark::points});
    without_noise.push_back({way.name, clean.response(grid, way.approach), Mark::dashed});
  }

  report::ComparisonTable difference;
  difference.title = "Indirect over direct: largest difference between the two estimates";
  const auto apart = errors(clean.response(grid, Approach::indirect), clean.response(grid, Approach::direct));
  difference.rows.push_back(row("noise-free, above 5 Hz", "dB", apart.decibel_above_5hz));
  difference.rows.push_back(row("noise-free, above 5 Hz", "deg", apart.degree_above_5hz));
  std::vector<double> rms;
  for (const auto& tracked : noisy)
    rms.push_back(errors(tracked.response(grid, Approach::indirect), tracked.response(grid, Approach::direct))
                      .rms_above_5hz);
  difference.rows.push_back(row("noisy, above 5 Hz, rms relative", "", spread(rms)));
  part.section.tables.push_back(std::move(difference));
  const auto prbs = io::shipped_experiment("vi_prbs_a");
  with_noise.push_back({"indirect, off line",
                        averaged_response(run(prbs, 1), known(prbs), Approach::indirect).band(2.0, 33.0),
                        Mark::line});
  add_bode(part.section, "Counterpart of figure 11, with noise", with_noise,
           "System A, lambda = 8, seed 1; off line from a PRBS by averaged spectra.");
  add_bode(part.section, "Counterpart of figure 11, noise-free", without_noise, "System A, lambda = 8.");
  part.summary.push_back(fmt::format(
      "Direct and indirect estimates of the sweep agree within {:.3f} dB above 5 Hz without noise (rms "
      "{:.1e} with it), as the source found.",
      apart.decibel_above_5hz, spread(rms).mean));
  return part;
}

}  // namespace resonid::reproduction::vi
