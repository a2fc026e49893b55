// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <resonid/fit/detail/response_modes.hpp>
#include <utility>

#include "fit/modes/extremum_candidates.hpp"
#include "fit/modes/local_modes.hpp"

namespace resonid::fit {
namespace {

constexpr double kUsable = 0.5;         // std/|G| of a line that shows a flank
constexpr double kBeyondChance = 30.0;  // chi-square of two parameters: 3e-7 for each place looked at
constexpr double kPerPair = 10.0;       // more for every further pair, whose place was looked for, too
constexpr int kMostTerms = 5;

/// Lines that a fit can use; without noise the polynomial's own error of some 1e-4 takes its place.
data::FrequencyResponse known_lines(const data::FrequencyResponse& g) {
  constexpr double kComputed = 1e-4;
  data::FrequencyResponse known;
  known.correlation = g.correlation;
  known.smoothing.width_hz = g.smoothing.width_hz;
  for (std::size_t i = 0; i < g.lines() && g.std.size() == g.lines(); ++i) {
    const double size = std::abs(g.value[i]);
    if (!(g.frequency_hz[i] > 0.0) || !std::isfinite(size) || !std::isfinite(g.std[i]) || !(size > 0.0))
      continue;
    known.frequency_hz.push_back(g.frequency_hz[i]);
    known.value.push_back(g.value[i]);
    known.std.push_back(std::max(g.std[i], kComputed * size));
    if (!g.smoothing.slope.empty()) known.smoothing.slope.push_back(g.smoothing.slope[i]);
  }
  return known;
}

/// One window's account of a mode.
struct Account {
  LocalLines lines;
  LocalFit fit;
  double scale = 1.0;                              ///< chi-square per degree, at least 1
  double frequency_hz = 0.0, frequency_std = 0.0;  ///< std of ln f
  double damping = 0.0, damping_std = 0.0;
};

class Search {
 public:
  explicit Search(const data::FrequencyResponse& g) : g_(g) {}

  /// Alone, else with a neighbour: close pairs of poles and zeros are nothing one by one.
  void accept(const std::vector<ExtremumCandidate>& candidates) {
    std::vector<bool> taken(candidates.size(), false);
    constexpr int kPasses = 2;
    bool changed = true;
    for (int pass = 0; pass < kPasses && changed; ++pass) {
      changed = false;
      for (std::size_t c = 0; c < candidates.size(); ++c) {
        if (taken[c]) continue;
        if (add({candidates[c]})) {
          taken[c] = changed = true;
          continue;
        }
        const auto other = neighbour_of(c, candidates, taken);
        if (other && add({candidates[c], candidates[*other]})) taken[c] = taken[*other] = changed = true;
      }
    }
  }

  [[nodiscard]] std::vector<ResponseMode> modes(double least_db) {
    for (std::size_t r = 0; r < roots_.size(); ++r)
      if (const auto account = best_account(r)) roots_[r] = root_of(*account);
    std::vector<ResponseMode> found;
    for (std::size_t r = 0; r < roots_.size(); ++r) {
      const auto account = best_account(r);
      if (!account) continue;
      const double f = account->frequency_hz;
      ResponseMode mode;
      mode.mode = {
          roots_[r].zero, {f, f * account->frequency_std}, {account->damping, account->damping_std}, false};
      mode.prominence_db = prominence_db(*account, roots_[r].zero);
      if (mode.prominence_db >= least_db) found.push_back(mode);
    }
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
      return a.mode.frequency_hz.value < b.mode.frequency_hz.value;
    });
    return found;
  }

 private:
  /// Lines of a window, those near its roots first where there are very many; roots beside it stay as they
  /// are.
  [[nodiscard]] LocalLines window(double centre_hz, double half_width,
                                  const std::vector<LocalRoot>& known) const {
    constexpr std::size_t kMost = 300;
    LocalLines lines;
    lines.centre_hz = centre_hz;
    lines.half_width = half_width;
    lines.known = known;
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t i = 0; i < g_.lines(); ++i) {
      const double distance = std::abs(std::log(g_.frequency_hz[i] / centre_hz));
      if (distance <= half_width) near.emplace_back(distance, i);
    }
    if (near.size() > kMost) {
      std::sort(near.begin(), near.end());
      auto kept = std::vector(near.begin(), near.begin() + kMost / 2);
      const std::size_t rest = near.size() - kMost / 2;
      for (std::size_t k = 0; k < kMost / 2; ++k) kept.push_back(near[kMost / 2 + k * rest / (kMost / 2)]);
      near = std::move(kept);
    }
    for (const auto& n : near) lines.line.push_back(n.second);
    std::sort(lines.line.begin(), lines.line.end());
    return lines;
  }

  /// Roots so near to the centre that they are fitted with it, and the others.
  [[nodiscard]] std::pair<std::vector<LocalRoot>, std::vector<LocalRoot>> parted(double centre_hz,
                                                                                 double reach) const {
    std::pair<std::vector<LocalRoot>, std::vector<LocalRoot>> parts;
    for (const auto& root : roots_)
      (std::abs(std::log(root.frequency_hz / centre_hz)) <= reach ? parts.first : parts.second)
          .push_back(root);
    return parts;
  }

  [[nodiscard]] bool sane(const LocalRoot& root, const LocalLines& lines) const {
    return std::abs(std::log(root.frequency_hz / lines.centre_hz)) < 0.8 * lines.half_width &&
           root.damping_ratio < 1.0 && root.damping_ratio > -0.1;
  }

  /// Whether known lines lie on either side, and not just the few that chance makes known.
  [[nodiscard]] bool has_flanks(double f) const {
    constexpr double kReach = 1.6, kShare = 0.3;
    int below = 0, above = 0, all_below = 0, all_above = 0;
    for (std::size_t i = 0; i < g_.lines(); ++i) {
      const int known = g_.std[i] < kUsable * std::abs(g_.value[i]) ? 1 : 0;
      if (g_.frequency_hz[i] < f && g_.frequency_hz[i] > f / kReach) below += known, ++all_below;
      if (g_.frequency_hz[i] > f && g_.frequency_hz[i] < f * kReach) above += known, ++all_above;
    }
    return below >= 2 && above >= 2 && below > kShare * all_below && above > kShare * all_above;
  }

  static std::optional<std::size_t> neighbour_of(std::size_t c,
                                                 const std::vector<ExtremumCandidate>& candidates,
                                                 const std::vector<bool>& taken) {
    std::optional<std::size_t> nearest;
    double least = 0.5;  // of ln f
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const double distance = std::abs(std::log(candidates[i].frequency_hz / candidates[c].frequency_hz));
      if (taken[i] || candidates[i].minimum == candidates[c].minimum || distance >= least) continue;
      nearest = i;
      least = distance;
    }
    return nearest;
  }

  /// Takes candidates in if pairs of roots there explain what nothing else does.
  bool add(const std::vector<ExtremumCandidate>& candidates) {
    const double centre_hz = candidates.front().frequency_hz;
    if (!has_flanks(centre_hz)) return false;
    for (const double half_width : {0.2, 0.4, 0.8}) {
      const auto [beside, known] = parted(centre_hz, half_width);
      const auto lines = window(centre_hz, half_width, known);
      constexpr int kDegree = 3;
      const auto without = fit_local(g_, lines, beside, kDegree);
      if (!without.usable) continue;
      LocalFit best;
      for (const double damping : {0.004, 0.03, 0.15}) {
        auto roots = beside;
        for (const auto& c : candidates) roots.push_back({c.minimum, c.frequency_hz, damping});
        auto fit = fit_local(g_, lines, std::move(roots), kDegree);
        if (fit.usable && (!best.usable || fit.chi_square < best.chi_square)) best = std::move(fit);
      }
      if (!best.usable) continue;
      const double scale = std::max(1.0, best.chi_square / best.degrees);
      const auto added = best.roots.end() - static_cast<std::ptrdiff_t>(candidates.size());
      const bool all_sane =
          std::all_of(best.roots.begin(), added, [](const LocalRoot& r) { return r.damping_ratio < 1.0; }) &&
          std::all_of(added, best.roots.end(), [&](const LocalRoot& r) { return sane(r, lines); });
      // Twice the drop of sum |e|^2/std^2 is that of -2 ln of the likelihood.
      const double needed = kBeyondChance + kPerPair * static_cast<double>(candidates.size() - 1);
      if (2.0 * (without.chi_square - best.chi_square) / scale < needed || !all_sane) continue;
      roots_ = known;
      roots_.insert(roots_.end(), best.roots.begin(), best.roots.end());
      return true;
    }
    return false;
  }

  /// The accounts of root r by a window: with the least degree after which more terms explain only noise, and
  /// with some more, which shows what the polynomial may have hidden.
  void put_accounts(std::size_t r, double half_width, std::vector<Account>& to) const {
    const auto& target = roots_[r];
    auto [beside, known] = parted(target.frequency_hz, half_width);
    const auto same = std::find_if(beside.begin(), beside.end(), [&](const LocalRoot& b) {
      return b.zero == target.zero && b.frequency_hz == target.frequency_hz;
    });
    std::iter_swap(beside.begin(), same);
    const auto lines = window(target.frequency_hz, half_width, known);
    std::array<LocalFit, kMostTerms + 1> fits;
    int least = 0;
    for (int degree = 1; degree <= kMostTerms; ++degree) {
      auto& fit = fits[static_cast<std::size_t>(degree)];
      const auto& before = fits[static_cast<std::size_t>(least)];
      fit = fit_local(g_, lines, before.usable ? before.roots : beside, degree, before.background);
      if (!fit.usable || fit.degrees < 4.0) {
        fit.usable = false;
        break;
      }
      constexpr double kTerm = 8.0;  // chi-square of two parameters: 2 %
      const double scale = std::max(1.0, fit.chi_square / fit.degrees);
      if (!before.usable || 2.0 * (before.chi_square - fit.chi_square) / scale >= kTerm) least = degree;
    }
    constexpr int kFurther = 2;
    for (const int degree : {least, std::min(least + kFurther, kMostTerms)}) {
      auto& fit = fits[static_cast<std::size_t>(degree)];
      if (fit.usable) put_account(lines, std::exchange(fit, {}), to);
    }
  }

  void put_account(const LocalLines& lines, LocalFit fit, std::vector<Account>& to) const {
    const auto root = fit.roots.front();
    if (!sane(root, lines)) return;
    Account a;
    a.lines = lines;
    a.scale = std::max(1.0, fit.chi_square / fit.degrees);
    a.frequency_hz = root.frequency_hz;
    a.damping = root.damping_ratio;
    a.frequency_std = std::sqrt(std::max(0.0, a.scale * fit.covariance(0, 0)));
    a.damping_std = std::sqrt(std::max(0.0, a.scale * fit.covariance(1, 1)));
    a.fit = std::move(fit);
    if (a.frequency_std > 0.0 && a.frequency_std < 0.3) to.push_back(std::move(a));
  }

  /// Of the windows in which noise explains what is left the one that tells most; what the others differ
  /// from it beyond noise is the model's error.
  [[nodiscard]] std::optional<Account> best_account(std::size_t r) const {
    std::vector<Account> all;
    for (const double half_width : {1.0, 0.7, 0.5, 0.35, 0.25, 0.17, 0.12, 0.08, 0.05})
      put_accounts(r, half_width, all);
    if (all.empty()) return std::nullopt;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& a : all) least = std::min(least, a.scale);
    std::erase_if(all,
                  [&](const Account& a) { return a.scale > least * (1.0 + 3.0 / std::sqrt(a.fit.degrees)); });
    auto chosen = *std::min_element(all.begin(), all.end(), [](const Account& a, const Account& b) {
      return a.frequency_std < b.frequency_std;
    });
    const auto beyond = [](double difference, double own, double others) {
      const double chance = 4.0 * std::max(0.0, others * others - own * own);
      return std::max(0.0, difference * difference - chance);
    };
    constexpr double kTellsLess = 5.0;
    double frequency = 0.0, damping = 0.0;
    for (const auto& a : all) {
      // A window that tells much less has little to say against it.
      if (a.frequency_std > kTellsLess * chosen.frequency_std) continue;
      frequency = std::max(frequency, beyond(std::log(a.frequency_hz / chosen.frequency_hz),
                                             chosen.frequency_std, a.frequency_std));
      damping = std::max(damping, beyond(a.damping - chosen.damping, chosen.damping_std, a.damping_std));
    }
    const double coarse = coarseness(chosen);
    chosen.frequency_std = std::hypot(chosen.frequency_std, coarse);
    chosen.damping_std = std::hypot(chosen.damping_std, coarse);
    chosen.frequency_std = std::sqrt(chosen.frequency_std * chosen.frequency_std + 0.25 * frequency);
    chosen.damping_std = std::sqrt(chosen.damping_std * chosen.damping_std + 0.25 * damping);
    return chosen;
  }

  /// Error of ln f by what a method's smoothing over frequency makes of a mode that is hardly wider: no part
  /// of the lines' own bars. A share of their distance, less the wider the mode is.
  [[nodiscard]] double coarseness(const Account& account) const {
    if (g_.correlation.distance_hz.empty()) return 0.0;
    constexpr double kShare = 0.2;
    const double f = account.frequency_hz;
    const auto at =
        static_cast<std::size_t>(std::lower_bound(g_.frequency_hz.begin() + 1, g_.frequency_hz.end() - 1, f) -
                                 g_.frequency_hz.begin());
    const double distance = g_.frequency_hz[at] - g_.frequency_hz[at - 1];
    return kShare * distance / f * distance / (distance + std::abs(account.damping) * f);
  }

  [[nodiscard]] static LocalRoot root_of(const Account& account) { return account.fit.roots.front(); }

  /// Of the fitted curve within the window, of the lines beside it.
  [[nodiscard]] double prominence_db(const Account& account, bool minimum) const {
    constexpr int kPoints = 400;
    const double low = account.lines.centre_hz * std::exp(-account.lines.half_width);
    const double high = account.lines.centre_hz * std::exp(account.lines.half_width);
    const double first = std::max(low, g_.frequency_hz.front()),
                 last = std::min(high, g_.frequency_hz.back());
    std::vector<std::pair<double, double>> curve;
    for (std::size_t i = 0; i < g_.lines(); ++i)
      if ((g_.frequency_hz[i] < first || g_.frequency_hz[i] > last) &&
          g_.std[i] < kUsable * std::abs(g_.value[i]))
        curve.emplace_back(g_.frequency_hz[i], std::abs(g_.value[i]));
    const double f0 = account.frequency_hz;
    const double own = std::clamp(std::abs(account.damping), 1e-3, 0.5);
    // No deeper than the noise of its nearest line lets see.
    const auto nearest = static_cast<std::size_t>(
        std::min_element(g_.frequency_hz.begin(), g_.frequency_hz.end(),
                         [&](double a, double b) { return std::abs(a - f0) < std::abs(b - f0); }) -
        g_.frequency_hz.begin());
    const double least = minimum ? g_.std[nearest] : 0.0;
    const auto add = [&](double f) {
      if (f >= first && f <= last)
        curve.emplace_back(f, std::hypot(least, magnitude(account.fit, account.lines, f)));
    };
    for (int k = 0; k <= kPoints; ++k) {
      add(first * std::pow(last / first, static_cast<double>(k) / kPoints));
      add(f0 * (1.0 + 2.0 * own * (2.0 * k / kPoints - 1.0)));
    }
    std::sort(curve.begin(), curve.end());
    std::vector<double> level;
    for (const auto& c : curve)
      level.push_back((minimum ? -20.0 : 20.0) * std::log10(std::max(c.second, 1e-300)));
    double highest = 0.0;
    for (std::size_t i = 1; i + 1 < curve.size(); ++i) {
      if (std::abs(std::log(curve[i].first / f0)) > 2.0 * own + 0.02) continue;
      if (level[i] >= level[i - 1] && level[i] > level[i + 1])
        highest = std::max(highest, prominence(level, i));
    }
    return highest;
  }

  const data::FrequencyResponse& g_;
  std::vector<LocalRoot> roots_;
};

}  // namespace

std::vector<ResponseMode> response_modes(const data::FrequencyResponse& response, double least_db) {
  constexpr std::size_t kFewest = 8;
  const auto known = known_lines(response);
  if (known.lines() < kFewest) return {};
  Search search(known);
  search.accept(extremum_candidates(known));
  auto modes = search.modes(least_db);
  // A fit to the flank of something beyond the lines tells its slope, not where it is.
  std::erase_if(modes, [&](const ResponseMode& m) {
    const double f = m.mode.frequency_hz.value;
    return f < known.frequency_hz.front() || f > known.frequency_hz.back();
  });
  return modes;
}

}  // namespace resonid::fit
