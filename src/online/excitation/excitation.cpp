// SPDX-License-Identifier: MIT
#include <algorithm>
#include <limits>
#include <resonid/online/excitation/excitation.hpp>
#include <type_traits>

namespace resonid::online {
namespace {

/// std::visit without its exception: calls `f` with the generator, if there is one.
template <class Generator, class F>
void with(Generator& generator, F&& f) noexcept {
  if (auto* prbs = std::get_if<Prbs>(&generator)) return f(*prbs);
  if (auto* multisine = std::get_if<Multisine<kMaxLines>>(&generator)) return f(*multisine);
  if (auto* chirp = std::get_if<Chirp>(&generator)) return f(*chirp);
  if (auto* stepped = std::get_if<SteppedSine<kMaxLines>>(&generator)) return f(*stepped);
}

template <class T>
expected<Excitation::Generator, Error> widen(const expected<T, Error>& made) {
  if (!made) return unexpected(made.error());
  return Excitation::Generator(*made);
}

/// What is wrong with the lists of a multisine beside its lines.
expected<void, Error> check_lists(const ExcitationConfig& c) {
  if (c.phases != Phases::given && c.phases_rad.count > 0)
    return refuse("phases_rad", "must be empty unless phases is given",
                  static_cast<double>(c.phases_rad.count));
  if (c.phases == Phases::given && c.phases_rad.count != c.lines_hz.count)
    return refuse("phases_rad", "must hold one phase per line", static_cast<double>(c.phases_rad.count));
  if (c.line_amplitudes.count == 0) return {};
  if (!(c.amplitude > 0.0)) return refuse("amplitude", "must be > 0", c.amplitude);
  if (c.line_amplitudes.count != c.lines_hz.count)
    return refuse("line_amplitudes", "must hold one value per line",
                  static_cast<double>(c.line_amplitudes.count));
  for (const double a : c.line_amplitudes.values())
    if (!(a > 0.0)) return refuse("line_amplitudes", "must be > 0", a);
  return {};
}

MultisineConfig multisine_of(const ExcitationConfig& c, double rate, std::span<const double> amplitude) {
  return {.sample_rate_hz = rate,
          .frequency_hz = c.lines_hz.hz(),
          .amplitude = amplitude,
          .phases = c.phases,
          .phase_rad = c.phases_rad.values(),
          .seed = c.seed,
          .periods_per_realisation = c.periods_per_realisation};
}

expected<Excitation::Generator, Error> make_multisine(const ExcitationConfig& config, double rate) {
  const auto kept = with_kept_lines(config, rate);
  if (!kept) return unexpected(kept.error());
  if (kept->line_amplitudes.count == 0)
    return widen(Multisine<kMaxLines>::create(multisine_of(*kept, rate, std::span(&kept->amplitude, 1))));
  LineList scaled = kept->line_amplitudes;
  for (std::size_t i = 0; i < scaled.count; ++i) scaled.value[i] *= kept->amplitude;
  return widen(Multisine<kMaxLines>::create(multisine_of(*kept, rate, scaled.values())));
}

/// The values of the lines that stay.
void keep(LineList& list, std::span<const bool> kept) {
  if (list.count == 0) return;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) list.value[count++] = list.value[i];
  list.count = count;
}

/// Where std::size_t has 32 bits, larger numbers become its largest: as good as endless.
std::size_t size(std::uint64_t number) {
  return static_cast<std::size_t>(std::min<std::uint64_t>(number, std::numeric_limits<std::size_t>::max()));
}

expected<Excitation::Generator, Error> make(const ExcitationConfig& c, double rate) {
  switch (c.kind) {
    case Kind::none:
      break;
    case Kind::prbs:
      return widen(Prbs::create({rate, c.amplitude, size(c.register_length), size(c.clock_divider), 1}));
    case Kind::multisine:
      return make_multisine(c, rate);
    case Kind::chirp:
      return widen(
          Chirp::create({rate, c.amplitude, c.from_hz, c.to_hz, c.duration_s, c.sweep, c.repeat, 0.0}));
    case Kind::stepped_sine:
      return widen(SteppedSine<kMaxLines>::create(
          {rate, c.lines_hz.hz(), c.amplitude, c.settle_periods, c.measure_periods}));
  }
  return Excitation::Generator();
}

}  // namespace

bool LineList::assign(std::span<const double> hz) noexcept {
  if (hz.size() > kMaxLines) return false;
  std::copy(hz.begin(), hz.end(), value.begin());
  count = hz.size();
  return true;
}

expected<ExcitationConfig, Error> with_kept_lines(const ExcitationConfig& config, double sample_rate_hz) {
  if (config.kind != Kind::multisine) return config;
  if (const auto ok = check_lists(config); !ok) return unexpected(ok.error());
  if (config.detection_lines == DetectionLines::nothing) return config;
  const double any = 1.0;
  if (const auto ok = check(multisine_of(config, sample_rate_hz, std::span(&any, 1)), kMaxLines); !ok)
    return unexpected(ok.error());
  std::array<bool, kMaxLines> room{};
  const auto kept = std::span(room).first(config.lines_hz.count);
  const DetectionLinesConfig left_out{sample_rate_hz, config.lines_hz.hz(), config.detection_lines,
                                      config.group, config.seed};
  if (const auto ok = mark_kept_lines(left_out, kept); !ok) return unexpected(ok.error());
  ExcitationConfig result = config;
  result.detection_lines = DetectionLines::nothing;
  for (LineList* list : {&result.lines_hz, &result.line_amplitudes, &result.phases_rad}) keep(*list, kept);
  return result;
}

expected<Excitation, Error> Excitation::create(const ExcitationConfig& config, double sample_rate_hz) {
  if (!(sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", sample_rate_hz);
  const auto made = make(config, sample_rate_hz);
  if (!made) return unexpected(made.error());
  return Excitation(*made);
}

double Excitation::step() noexcept {
  double value = 0.0;
  with(generator_, [&](auto& g) { value = g.step(); });
  return value;
}

void Excitation::reset() noexcept {
  with(generator_, [](auto& g) { g.reset(); });
}

std::size_t Excitation::natural_length_samples() const noexcept {
  std::size_t length = 0;
  with(generator_, [&](const auto& g) {
    if constexpr (requires { g.length_samples(); })
      length = g.length_samples();
    else
      length = g.period_samples();
  });
  return length;
}

std::size_t Excitation::period_samples() const noexcept {
  std::size_t period = 0;
  with(generator_, [&](const auto& g) {
    if constexpr (requires { g.period_samples(); })
      period = g.period_samples();
    else if constexpr (std::is_same_v<std::decay_t<decltype(g)>, Chirp>)
      period = g.config().repeat ? g.length_samples() : 0;
  });
  return period;
}

Band Excitation::band() const noexcept {
  Band band;
  with(generator_, [&](const auto& g) { band = g.band(); });
  return band;
}

}  // namespace resonid::online
