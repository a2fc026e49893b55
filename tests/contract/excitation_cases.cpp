// SPDX-License-Identifier: MIT
#include <array>
#include <resonid/online/excitation/excitation.hpp>

#include "subject.hpp"

namespace resonid::test {
namespace {

using namespace resonid::online;

constexpr std::array<double, 3> kLines{7.0, 12.0, 31.0};

struct Generator {
  using Scalar = double;
  static constexpr bool kTyped = false;
  static constexpr unsigned kArguments = 0;
  static constexpr double kRecovered = 0.0;
  template <class E>
  static std::tuple<> arguments(const E&, const Sample&) noexcept {
    return {};
  }
  template <class E>
  static void observe(const E&, Answers&) noexcept {}
};

struct PrbsTraits : Generator {
  using Listed = Prbs;
  static constexpr std::string_view kName = "Prbs", kAsListed = "",
                                    kCost = "constant but for the clock divider";
  static Prbs make() {
    return Prbs::create({.sample_rate_hz = kRateHz, .register_length = 9, .clock_divider = 3}).value();
  }
};
struct MultisineTraits : Generator {
  using Listed = Multisine<21>;
  static constexpr std::string_view kName = "Multisine", kAsListed = "21 lines",
                                    kCost = "lines; every 256th sample sets them anew";
  static Multisine<21> make() {
    static constexpr std::array<double, 1> kAmplitude{0.5};
    return Multisine<21>::create({.sample_rate_hz = kRateHz, .frequency_hz = kLines, .amplitude = kAmplitude})
        .value();
  }
};
struct ChirpTraits : Generator {
  using Listed = Chirp;
  static constexpr std::string_view kName = "Chirp", kAsListed = "",
                                    kCost = "a cosine; logarithmic: an exponential too";
  static Chirp make() {
    return Chirp::create({.sample_rate_hz = kRateHz,
                          .from_hz = 2.0,
                          .to_hz = 90.0,
                          .duration_s = 7.0,
                          .sweep = Sweep::logarithmic,
                          .repeat = true})
        .value();
  }
};
struct SteppedSineTraits : Generator {
  using Listed = SteppedSine<21>;
  static constexpr std::string_view kName = "SteppedSine", kAsListed = "21 lines", kCost = "a cosine";
  static SteppedSine<21> make() {
    return SteppedSine<21>::create({.sample_rate_hz = kRateHz, .frequency_hz = kLines}).value();
  }
};
struct ExcitationTraits : Generator {
  using Listed = Excitation;
  static constexpr std::string_view kName = "Excitation", kAsListed = "", kCost = "that of the one chosen";
  static Excitation make() {
    ExcitationConfig c;
    c.kind = Kind::multisine;
    c.lines_hz.assign(kLines);
    return Excitation::create(c, kRateHz).value();
  }
};

}  // namespace

void add_excitation_cases(std::vector<Case>& all) {
  all.push_back(case_of<PrbsTraits>());
  all.push_back(case_of<MultisineTraits>());
  all.push_back(case_of<ChirpTraits>());
  all.push_back(case_of<SteppedSineTraits>());
  all.push_back(case_of<ExcitationTraits>());
}

}  // namespace resonid::test
