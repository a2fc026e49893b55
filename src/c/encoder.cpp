// SPDX-License-Identifier: MIT
#include <resonid/c/detail/lines.h>

#include <resonid/online/lines/encoder.hpp>

#include "handle.hpp"

namespace resonid::c {
namespace {

using Encoder = online::EncoderVelocity<double>;
static_assert(static_cast<std::uint32_t>(online::EncoderKind::absolute_turn) ==
              type_of(RESONID_ENCODER_ABSOLUTE));

struct Encoders : Variants<Encoders, Encoder> {
  using Settings = resonid_encoder_settings;
  using Results = resonid_encoder_results;
  static constexpr std::uint32_t kId = family_of(RESONID_ENCODER_COUNTER), kTypes = 2;

  static Settings defaults(std::uint32_t) noexcept {
    const online::EncoderConfig e;
    Settings s{};
    s.travel_per_turn = e.travel_per_turn;
    s.bits = e.bits;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings&) noexcept { return 0U; }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    online::EncoderConfig e;
    e.sample_rate_hz = s.sample_rate_hz;
    e.kind = static_cast<online::EncoderKind>(type_of(s.head.kind));
    e.bits = s.bits;
    e.counts_per_turn = s.counts_per_turn;
    e.travel_per_turn = s.travel_per_turn;
    e.reversed = s.reversed != 0;
    e.largest_velocity = s.largest_velocity;
    return place(memory, s.head.kind, variant, Encoder::create(e));
  }
  static void results(const Encoder& encoder, Results& r) noexcept {
    r.samples = encoder.samples();
    r.skipped_samples = encoder.skipped_samples();
    r.implausible_samples = encoder.implausible_samples();
    r.position_counts = encoder.position_counts();
    r.position = encoder.position();
    r.velocity = encoder.velocity();
    r.last_velocity = encoder.last_velocity();
    r.resolution = encoder.resolution();
    r.certain = encoder.certain() ? 1 : 0;
  }
};

}  // namespace

const Family kEncoder = FamilyOf<Encoders>::kFamily;

}  // namespace resonid::c

using resonid::c::Encoders;

resonid_status resonid_encoder_step(resonid_handle* encoder, uint64_t raw, double* velocity) noexcept {
  return Encoders::visit(encoder, [&](auto& e) {
    e.step(raw);
    if (velocity != nullptr) *velocity = e.velocity();
  });
}
resonid_status resonid_encoder_set_position(resonid_handle* encoder, int64_t counts) noexcept {
  return Encoders::visit(encoder, [&](auto& e) { e.set_position_counts(counts); });
}
