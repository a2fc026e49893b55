// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <identification/identify/judge/root_cause.hpp>
#include <identification/identify/judge/weak_excitation.hpp>
#include <limits>
#include <resonid/identification/options.hpp>
#include <string_view>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

constexpr std::string_view kQuantity = "other-quantity";
constexpr std::string_view kWeak = "weak-excitation";
/// Nothing of the result means anything then.
constexpr std::array<std::string_view, 5> kVoid = {"no-excitation", "dead-output", kQuantity, "reversed",
                                                   "incoherent"};
/// Errors by how near they are to the cause, the data first, what the model lacks last; what stands in no
/// list is as near as the machine.
constexpr std::array<std::string_view, 8> kOfData = {"outlier",          "stuck-output", "limited-output",
                                                     "position-jumps",   "gaps",         "dropped-samples",
                                                     "repeated-samples", "saturation"};
constexpr std::array<std::string_view, 13> kOfModel = {"misfit",
                                                       "differs-over-frequency",
                                                       "response-shows-more",
                                                       "response-shows-less",
                                                       "uncertain-inertia",
                                                       "uncertain-resonance",
                                                       "unexplained-response",
                                                       "fails-on-held-back",
                                                       "explains-nothing",
                                                       "not-converged",
                                                       "unstable-model",
                                                       "mode-above-nyquist",
                                                       "no-model"};

template <std::size_t N>
bool among(const std::array<std::string_view, N>& ids, const Finding& f) {
  return std::find(ids.begin(), ids.end(), f.id) != ids.end();
}

/// From the cause; those of what a model lacks one behind the other.
std::size_t distance(const Finding& f) {
  if (among(kOfData, f)) return 0;
  if (among(kVoid, f) || f.id == kWeak) return 1;
  const auto of_model = std::find(kOfModel.begin(), kOfModel.end(), f.id);
  return of_model == kOfModel.end() ? 2 : 3 + static_cast<std::size_t>(of_model - kOfModel.begin());
}

bool is_error(const Finding& f) { return f.severity == Severity::error; }

void discard_model(Result& result) {
  result.model.reset();
  result.black_box.reset();
  result.loop.reset();
  result.validation.reset();
  result.second_output.reset();
  result.structures.clear();
  result.bootstrap.reset();
  result.roots.clear();
  result.residual.clear();
  std::erase_if(result.modes, [](const data::Mode& mode) { return mode.from_model; });
  std::erase_if(result.choices, [](const Choice& choice) { return choice.what == "structure"; });
}

}  // namespace

bool is_misnamed(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& f) { return is_error(f) && f.id == kQuantity; });
}

void keep_root_cause(bool discards_model, Result& result) {
  auto& findings = result.findings;
  std::size_t nearest = std::numeric_limits<std::size_t>::max();
  for (const auto& f : findings)
    if (is_error(f)) nearest = std::min(nearest, distance(f));
  if (nearest == std::numeric_limits<std::size_t>::max()) return;
  const bool drowned = std::any_of(findings.begin(), findings.end(), drowns_everything);
  const bool means_nothing = drowned || (result.method != name_of(Method::model) &&
                                         std::any_of(findings.begin(), findings.end(), [](const Finding& f) {
                                           return is_error(f) && among(kVoid, f);
                                         }));
  const bool of_noise = std::any_of(findings.begin(), findings.end(), [](const Finding& f) {
    return is_error(f) && (f.id == "incoherent" || drowns_everything(f));
  });
  // Of one cause the first is told; of data there may be several.
  bool told = false;
  for (auto& f : findings) {
    if (!is_error(f)) {
      f.follows = means_nothing && !among(kOfData, f) && f.id != "jitter" && f.id != "filled-samples";
      continue;
    }
    f.follows = distance(f) > nearest || (told && nearest > 0);
    told = told || !f.follows;
    if (f.follows) f.severity = Severity::info;
  }
  std::stable_partition(findings.begin(), findings.end(), is_error);
  if (means_nothing && (discards_model || of_noise)) discard_model(result);
  if (means_nothing && of_noise)
    std::erase_if(result.modes, [](const data::Mode& m) { return !m.from_model; });
}

}  // namespace resonid::identification::detail
