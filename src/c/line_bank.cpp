// SPDX-License-Identifier: MIT
#include <resonid/c/tracking.h>

#include <resonid/online/lines/line_bank.hpp>

#include "handle.hpp"
#include "tracker_config.hpp"

namespace resonid::c {
namespace {

template <class Real, std::size_t Channels>
using Bank = online::LineBank<Real, RESONID_LINE_BANK_MAX_LINES, Channels>;

resonid_line_bank_config line_bank_defaults() noexcept {
  const online::KalmanBankConfig bank;
  resonid_line_bank_config c{};
  c.channels = 2;
  c.offset = bank.offset ? 1 : 0;
  c.lambda = bank.lambda;
  c.pole_radius = bank.pole_radius;
  return c;
}

struct LineBanks
    : Variants<RESONID_FAMILY_LINE_BANK, Bank<double, 2>, Bank<double, 3>, Bank<float, 2>, Bank<float, 3>> {
  using Config = resonid_line_bank_config;
  using Handle = resonid_line_bank;

  static Config defaults_for(const Config*) noexcept { return line_bank_defaults(); }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    if (c.precision > RESONID_FLOAT) return refuse("precision", "must be one of its constants", c.precision);
    if (c.channels < 2 || c.channels > 3) return refuse("channels", "must be 2 or 3", c.channels);
    return 2 * c.precision + (c.channels - 2);
  }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    const auto gain = enumerator("gain", c.gain, online::GainRule::placed_poles);
    if (!gain) return unexpected<Error>(gain.error());
    online::LineBankConfig config;
    config.bank = {c.sample_rate_hz, array(c.frequency_hz, c.lines), c.offset != 0, *gain, c.lambda,
                   c.pole_radius};
    config.known_delay_s = c.known_delay_s;
    switch (variant) {
      case 0:
        return make<Bank<double, 2>>(memory, variant, config);
      case 1:
        return make<Bank<double, 3>>(memory, variant, config);
      case 2:
        return make<Bank<float, 2>>(memory, variant, config);
      default:
        return make<Bank<float, 3>>(memory, variant, config);
    }
  }

 private:
  template <class T>
  static expected<void, Error> make(void* memory, std::uint32_t variant,
                                    const online::LineBankConfig& config) noexcept {
    const auto made = T::create(config);
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, variant, *made);
    return {};
  }
};
static_assert(LineBanks::kSize[1] <= RESONID_LINE_BANK_SIZE);

template <class Input>
resonid_status run(resonid_line_bank* handle, const Input* ru, const Input* u, const Input* y,
                   std::size_t count) noexcept {
  if (count > 0 && (u == nullptr || y == nullptr)) return RESONID_ERROR_NULL;
  return LineBanks::visit(handle, [&](auto& bank) -> resonid_status {
    using Sample = typename std::remove_reference_t<decltype(bank)>::Sample;
    using Real = typename Sample::value_type;
    constexpr bool kExcited = std::tuple_size_v<Sample> == 3;
    if (kExcited && ru == nullptr && count > 0) return RESONID_ERROR_NULL;
    for (std::size_t k = 0; k < count; ++k) {
      Sample z;
      z[RESONID_CHANNEL_U] = static_cast<Real>(u[k]);
      z[RESONID_CHANNEL_Y] = static_cast<Real>(y[k]);
      if constexpr (kExcited) z[RESONID_CHANNEL_RU] = static_cast<Real>(ru[k]);
      bank.step(z);
    }
    return RESONID_OK;
  });
}

}  // namespace
}  // namespace resonid::c

using resonid::c::LineBanks;

resonid_status resonid_line_bank_defaults(resonid_line_bank_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(resonid::c::line_bank_defaults(), config, struct_size);
}
size_t resonid_line_bank_size(const resonid_line_bank_config* config) noexcept {
  return resonid::c::size_of<LineBanks>(config);
}
resonid_status resonid_line_bank_init(void* memory, size_t size, const resonid_line_bank_config* config,
                                      resonid_line_bank** handle, resonid_error* error) noexcept {
  return resonid::c::init<LineBanks>(memory, size, config, handle, error);
}
resonid_status resonid_line_bank_create(const resonid_line_bank_config* config, resonid_line_bank** handle,
                                        resonid_error* error) noexcept {
  return resonid::c::create<LineBanks>(config, handle, error);
}
resonid_status resonid_line_bank_step(resonid_line_bank* handle, double u, double y) noexcept {
  return LineBanks::visit(handle, [&](auto& bank) -> resonid_status {
    using Real = typename std::remove_reference_t<decltype(bank)>::Scalar;
    if constexpr (std::remove_reference_t<decltype(bank)>::kChannels == 2) {
      bank.step(static_cast<Real>(u), static_cast<Real>(y));
      return RESONID_OK;
    } else {
      return RESONID_ERROR_UNSUPPORTED;
    }
  });
}
resonid_status resonid_line_bank_step_excited(resonid_line_bank* handle, double ru, double u,
                                              double y) noexcept {
  return LineBanks::visit(handle, [&](auto& bank) -> resonid_status {
    using Real = typename std::remove_reference_t<decltype(bank)>::Scalar;
    if constexpr (std::remove_reference_t<decltype(bank)>::kChannels == 3) {
      bank.step({static_cast<Real>(u), static_cast<Real>(y), static_cast<Real>(ru)});
      return RESONID_OK;
    } else {
      return RESONID_ERROR_UNSUPPORTED;
    }
  });
}
resonid_status resonid_line_bank_run(resonid_line_bank* handle, const double* ru, const double* u,
                                     const double* y, size_t count) noexcept {
  return resonid::c::run(handle, ru, u, y, count);
}
resonid_status resonid_line_bank_run_float(resonid_line_bank* handle, const float* ru, const float* u,
                                           const float* y, size_t count) noexcept {
  return resonid::c::run(handle, ru, u, y, count);
}
resonid_status resonid_line_bank_miss(resonid_line_bank* handle, uint64_t count) noexcept {
  return LineBanks::visit(handle, [&](auto& bank) { bank.miss(count); });
}
resonid_status resonid_line_bank_reset(resonid_line_bank* handle) noexcept {
  return LineBanks::visit(handle, [](auto& bank) { bank.reset(); });
}
resonid_status resonid_line_bank_responses(const resonid_line_bank* handle, resonid_complex* response,
                                           size_t count) noexcept {
  return LineBanks::visit(handle, [&](const auto& bank) -> resonid_status {
    if (const resonid_status status = resonid::c::check_array(response, count, bank.lines())) return status;
    for (std::size_t i = 0; i < count; ++i) response[i] = resonid::c::plain(bank.response(i));
    return RESONID_OK;
  });
}
resonid_status resonid_line_bank_ratio(const resonid_line_bank* handle, uint32_t line, uint32_t of,
                                       uint32_t over, resonid_complex* ratio) noexcept {
  if (ratio == nullptr) return RESONID_ERROR_NULL;
  return LineBanks::visit(handle, [&](const auto& bank) -> resonid_status {
    if (line >= bank.lines() || of >= bank.kChannels || over >= bank.kChannels) return RESONID_ERROR_RANGE;
    *ratio = resonid::c::plain(bank.response(line, over, of));
    return RESONID_OK;
  });
}
resonid_status resonid_line_bank_phasor(const resonid_line_bank* handle, uint32_t line, uint32_t channel,
                                        resonid_complex* phasor) noexcept {
  if (phasor == nullptr) return RESONID_ERROR_NULL;
  return LineBanks::visit(handle, [&](const auto& bank) -> resonid_status {
    if (line >= bank.lines() || channel >= bank.kChannels) return RESONID_ERROR_RANGE;
    *phasor = resonid::c::plain(bank.phasor(channel, line));
    return RESONID_OK;
  });
}
resonid_status resonid_line_bank_get_info(const resonid_line_bank* handle, resonid_line_bank_info* info,
                                          size_t struct_size) noexcept {
  resonid_line_bank_info found{};
  const resonid_status status = LineBanks::visit(handle, [&](const auto& bank) {
    found.lines = static_cast<std::uint32_t>(bank.lines());
    found.channels = bank.kChannels;
    found.ready = bank.ready() ? 1 : 0;
    found.settling_samples = bank.settling_samples();
    found.samples = bank.samples();
    found.skipped_samples = bank.skipped_samples();
    found.innovation_u = static_cast<double>(bank.innovation(RESONID_CHANNEL_U));
    found.innovation_y = static_cast<double>(bank.innovation(RESONID_CHANNEL_Y));
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
