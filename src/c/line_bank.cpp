// SPDX-License-Identifier: MIT
#include <resonid/c/detail/lines.h>

#include <resonid/online/lines/line_bank.hpp>

#include "handle.hpp"
#include "tracker_config.hpp"

namespace resonid::c {
namespace {

template <class Real, std::size_t Channels>
using Bank = online::LineBank<Real, RESONID_LINE_BANK_MAX_LINES, Channels>;

struct LineBanks : Variants<LineBanks, Bank<double, 2>, Bank<double, 3>, Bank<float, 2>, Bank<float, 3>> {
  using Settings = resonid_line_bank_settings;
  using Results = resonid_line_bank_results;
  static constexpr std::uint32_t kId = family_of(RESONID_LINE_BANK), kTypes = 1;

  static Settings defaults(std::uint32_t) noexcept {
    const online::KalmanBankConfig bank;
    Settings s{};
    s.channels = 2;
    s.offset = bank.offset ? 1 : 0;
    s.lambda = bank.lambda;
    s.pole_radius = bank.pole_radius;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    if (s.precision > RESONID_FLOAT) return refuse("precision", "must be one of its constants", s.precision);
    if (s.channels < 2 || s.channels > 3) return refuse("channels", "must be 2 or 3", s.channels);
    return 2 * s.precision + (s.channels - 2);
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto gain = enumerator("gain", s.gain, online::GainRule::placed_poles);
    if (!gain) return unexpected<Error>(gain.error());
    online::LineBankConfig config;
    config.bank = {s.sample_rate_hz, array(s.frequency_hz, s.lines), s.offset != 0, *gain, s.lambda,
                   s.pole_radius};
    config.known_delay_s = s.known_delay_s;
    const std::uint32_t kind = s.head.kind;
    switch (variant) {
      case 0:
        return place(memory, kind, variant, Bank<double, 2>::create(config));
      case 1:
        return place(memory, kind, variant, Bank<double, 3>::create(config));
      case 2:
        return place(memory, kind, variant, Bank<float, 2>::create(config));
      default:
        return place(memory, kind, variant, Bank<float, 3>::create(config));
    }
  }
  template <class Real, std::size_t Channels>
  static void step(Bank<Real, Channels>& bank, double ru, double u, double y) noexcept {
    if constexpr (Channels == 2)
      bank.step(static_cast<Real>(u), static_cast<Real>(y));
    else
      bank.step({static_cast<Real>(u), static_cast<Real>(y), static_cast<Real>(ru)});
  }
  template <class T>
  static constexpr bool kNeedsRu = T::kChannels == 3;
  template <class T>
  static void results(const T& bank, Results& r) noexcept {
    r.samples = bank.samples();
    r.skipped_samples = bank.skipped_samples();
    r.lines = static_cast<std::uint32_t>(bank.lines());
    r.channels = bank.kChannels;
    r.settling_samples = bank.settling_samples();
    r.ready = bank.ready() ? 1 : 0;
    r.innovation_u = static_cast<double>(bank.innovation(RESONID_CHANNEL_U));
    r.innovation_y = static_cast<double>(bank.innovation(RESONID_CHANNEL_Y));
  }
};
static_assert(handle_size<Bank<double, 3>>() <= RESONID_LINE_BANK_SIZE);

}  // namespace

const Family kLineBank = FamilyOf<LineBanks>::kFamily;

resonid_status line_bank_phasors(const resonid_handle* handle, std::uint32_t channel, resonid_complex* phasor,
                                 std::size_t count) noexcept {
  return LineBanks::visit(handle, [&](const auto& bank) -> resonid_status {
    if (channel >= bank.kChannels) return RESONID_ERROR_RANGE;
    if (const resonid_status status = check_array(phasor, count, bank.lines())) return status;
    for (std::size_t i = 0; i < count; ++i) phasor[i] = plain(bank.phasor(channel, i));
    return RESONID_OK;
  });
}

}  // namespace resonid::c

resonid_status resonid_ratios(const resonid_handle* line_bank, uint32_t of, uint32_t over,
                              resonid_complex* ratio, size_t count) noexcept {
  return resonid::c::LineBanks::visit(line_bank, [&](const auto& bank) -> resonid_status {
    if (of >= bank.kChannels || over >= bank.kChannels) return RESONID_ERROR_RANGE;
    if (const resonid_status status = resonid::c::check_array(ratio, count, bank.lines())) return status;
    for (std::size_t i = 0; i < count; ++i) ratio[i] = resonid::c::plain(bank.response(i, over, of));
    return RESONID_OK;
  });
}
