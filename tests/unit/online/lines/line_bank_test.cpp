// SPDX-License-Identifier: MIT
// Built twice: with the kernels of line_kernels.cpp, where every instruction set of this processor has its
// turn, and as a header alone, without RESONID_SIMD.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstring>
#include <limits>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/line_bank_block.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <string>
#include <vector>
#ifdef RESONID_SIMD
#include <hwy/targets.h>
#endif

namespace resonid::online {
namespace {

constexpr double kRate = 2000.0;

/// Calls `check(name)` with the kernels of each instruction set, then gives the best one back.
template <class Check>
void with_every_kernel(const Check& check) {
#ifdef RESONID_SIMD
  const std::int64_t supported = hwy::SupportedTargets();
  int tried = 0;
  for (std::int64_t rest = supported; rest != 0; rest &= rest - 1) {
    const std::int64_t target = rest & -rest;
    hwy::SetSupportedTargetsForTest(target);
    choose_line_kernels();
    check(std::string(hwy::TargetName(target)));
    ++tried;
  }
  hwy::SetSupportedTargetsForTest(0);
  choose_line_kernels();
  EXPECT_GE(tried, 2);
#else
  check(std::string("plain"));
#endif
}

std::vector<double> lines_hz(std::size_t count) {
  std::vector<double> f;
  for (std::size_t i = 0; i < count; ++i) f.push_back(13.0 + 29.0 * static_cast<double>(i));
  return f;
}

template <class Real, std::size_t MaxLines, std::size_t Channels = 2>
LineBank<Real, MaxLines, Channels> make(const std::vector<double>& f, bool offset = true) {
  LineBankConfig config;
  config.bank.sample_rate_hz = kRate;
  config.bank.frequency_hz = f;
  config.bank.offset = offset;
  config.bank.lambda = 20.0;
  config.known_delay_s = 0.0013;
  return LineBank<Real, MaxLines, Channels>::create(config).value();
}
template <class Real, std::size_t MaxLines, std::size_t Channels>
Oscillators<Real, MaxLines, Channels> make_plain(const std::vector<double>& f, bool offset) {
  KalmanBankConfig config;
  config.offset = offset;
  config.lambda = 20.0;
  std::array<double, MaxLines> angle{};
  for (std::size_t i = 0; i < f.size(); ++i) angle[i] = kTwoPi * f[i] / kRate;
  const std::span<const double> angles(angle.data(), f.size());
  Oscillators<Real, MaxLines, Channels> bank;
  bank.configure(angles, bank_gain<MaxLines>(angles, config));
  return bank;
}

/// Noise of a standard deviation of 1 with a constant; some samples of some channels are missing.
template <class Real, std::size_t Channels>
std::vector<std::array<Real, Channels>> noise(std::size_t count, unsigned seed, bool missing) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.3, 1.0);
  std::vector<std::array<Real, Channels>> z(count);
  for (std::size_t k = 0; k < count; ++k) {
    for (Real& x : z[k]) x = static_cast<Real>(normal(random));
    if (!missing || random() % 23 != 0) continue;
    const std::array bad{std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(),
                         -std::numeric_limits<Real>::infinity(), std::numeric_limits<Real>::signaling_NaN()};
    z[k][random() % Channels] = bad[random() % bad.size()];
  }
  return z;
}

template <class Real>
constexpr double kEqual = std::is_same_v<Real, double> ? 1e-12 : 1e-5;  // float: rounding of sums of 32 lines

template <class Real, std::size_t MaxLines, std::size_t Channels>
void expect_same_state(const LineBank<Real, MaxLines, Channels>& bank,
                       const Oscillators<Real, MaxLines, Channels>& plain, const std::string& where) {
  for (std::size_t c = 0; c < Channels; ++c) {
    for (std::size_t i = 0; i < bank.lines(); ++i)
      ASSERT_NEAR(std::abs(std::complex<double>(bank.phasor(c, i) - plain.phasor(i, c))), 0.0, kEqual<Real>)
          << where << ", channel " << c << ", line " << i;
    ASSERT_NEAR(bank.offset(c), plain.offset(c), kEqual<Real>) << where;
    ASSERT_NEAR(bank.innovation(c), plain.innovation(c), 10.0 * kEqual<Real>) << where;
  }
}

template <class Real, std::size_t MaxLines, std::size_t Channels>
void expect_as_plain(std::size_t lines, bool offset, const std::string& kernel) {
  const auto f = lines_hz(lines);
  auto bank = make<Real, MaxLines, Channels>(f, offset);
  auto plain = make_plain<Real, MaxLines, Channels>(f, offset);
  const std::string where =
      kernel + ", " + std::to_string(lines) + " lines, " + std::to_string(Channels) + " channels";
  std::uint64_t skipped = 0;
  for (const auto& z : noise<Real, Channels>(300, static_cast<unsigned>(lines), true)) {
    bank.step(z);
    skipped += plain.step_or_predict(z) ? 0U : 1U;
    ASSERT_NO_FATAL_FAILURE(expect_same_state(bank, plain, where));
  }
  EXPECT_GT(skipped, 3U);
  EXPECT_EQ(bank.skipped_samples(), skipped);
  EXPECT_EQ(bank.samples(), 300U);
}

TEST(LineBank, EveryInstructionSetFollowsThePlainLoops) {
  with_every_kernel([](const std::string& kernel) {
    for (std::size_t lines = 1; lines <= 32; ++lines) {
      for (const bool offset : {true, false}) {
        ASSERT_NO_FATAL_FAILURE((expect_as_plain<double, 32, 2>(lines, offset, kernel)));
        ASSERT_NO_FATAL_FAILURE((expect_as_plain<float, 32, 2>(lines, offset, kernel)));
      }
    }
    ASSERT_NO_FATAL_FAILURE((expect_as_plain<double, 21, 1>(21, true, kernel)));
    ASSERT_NO_FATAL_FAILURE((expect_as_plain<double, 21, 3>(20, true, kernel)));
    ASSERT_NO_FATAL_FAILURE((expect_as_plain<float, 5, 3>(5, true, kernel)));
    ASSERT_NO_FATAL_FAILURE(
        (expect_as_plain<double, 21, 4>(21, true, kernel)));  // more than kernels exist for
    ASSERT_NO_FATAL_FAILURE((expect_as_plain<double, 4, 2>(3, true, kernel)));
  });
}

/// Responses of all lines, at once and one by one, and nothing written behind the last.
template <class Real>
void expect_responses(std::size_t lines, const std::string& kernel) {
  auto bank = make<Real, 32>(lines_hz(lines)), other = bank;
  std::array<Real, 40> re{}, im{}, fused_re{}, fused_im{};
  for (auto* row : {&re, &im, &fused_re, &fused_im}) row->fill(Real(77));
  for (const auto& z : noise<Real, 2>(100, 5, true)) {
    bank.step(z);
    bank.responses(std::span(re).first(lines), std::span(im).first(lines));
    other.step(z, std::span(fused_re).first(lines), std::span(fused_im).first(lines));
    for (std::size_t i = 0; i < lines; ++i) {
      const std::complex<double> g(bank.response(i));
      const double bound = 10.0 * kEqual<Real> * (1.0 + std::abs(g));
      ASSERT_NEAR(std::abs(g - std::complex<double>(re[i], im[i])), 0.0, bound) << kernel;
      if constexpr (std::is_same_v<Real, double>) {
        ASSERT_NEAR(std::abs(g - std::complex<double>(fused_re[i], fused_im[i])), 0.0, bound) << kernel;
      }
    }
    for (std::size_t i = lines; i < 40; ++i) {
      ASSERT_EQ(re[i], Real(77)) << kernel;
      ASSERT_EQ(im[i], Real(77)) << kernel;
      ASSERT_EQ(fused_re[i], Real(77)) << kernel;
      ASSERT_EQ(fused_im[i], Real(77)) << kernel;
    }
  }
}

TEST(LineBank, ResponsesOfAllLinesAreThoseOfEach) {
  with_every_kernel([](const std::string& kernel) {
    for (std::size_t lines = 1; lines <= 32; ++lines) {
      ASSERT_NO_FATAL_FAILURE(expect_responses<double>(lines, kernel));
      ASSERT_NO_FATAL_FAILURE(expect_responses<float>(lines, kernel));
    }
  });
}

/// Against a plant that is a gain and a delay per line: y = |G| cos(w t + arg G), G known to the test only.
template <class Real>
double response_error(double scale) {
  const auto f = lines_hz(21);
  auto bank = make<Real, 21>(f);
  std::array<Real, 21> re{}, im{};
  const auto truth = [](std::size_t i) {
    return std::polar(0.1 + 0.2 * static_cast<double>(i), 0.3 * static_cast<double>(i));
  };
  for (int k = 0; k < 8000; ++k) {
    double u = 0.4, y = -2.0;
    for (std::size_t i = 0; i < f.size(); ++i) {
      const double turn = kTwoPi * f[i], t = k / kRate, phase = 0.7 * static_cast<double>(i * i);
      u += std::cos(turn * t + phase);
      y += (truth(i) * std::polar(1.0, turn * (t - 0.0013) + phase)).real();
    }
    bank.step({static_cast<Real>(scale * u), static_cast<Real>(scale * y)}, re, im);
  }
  EXPECT_TRUE(bank.ready());
  double worst = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i)
    worst = std::max(worst, std::abs(std::complex<double>(re[i], im[i]) / truth(i) - 1.0));
  return worst;
}

TEST(LineBank, FindsTheResponseOfAKnownPlant) {
  with_every_kernel([](const std::string& kernel) {
    EXPECT_LT(response_error<double>(1.0), 1e-10) << kernel;
    EXPECT_LT(response_error<float>(1.0), 2e-4) << kernel;
  });
}

/// The same signals times a power of two: the response must not change, from 1e-150 to 1e150.
TEST(LineBank, ResponseDoesNotDependOnTheScale) {
  with_every_kernel([](const std::string& kernel) {
    auto bank = make<double, 32>(lines_hz(29));
    std::array<double, 32> re{}, im{};
    bank.responses(re, im);
    for (std::size_t i = 0; i < 29; ++i) EXPECT_TRUE(re[i] == 0.0 && im[i] == 0.0) << kernel;  // no input yet
    const auto z = noise<double, 2>(100, 9, false);
    for (int exponent = -500; exponent <= 500; exponent += 20) {
      bank.reset();
      for (const auto& s : z) bank.step({std::ldexp(s[0], exponent), std::ldexp(s[1], exponent)}, re, im);
      std::array<double, 32> one_re{}, one_im{};
      bank.reset();
      for (const auto& s : z) bank.step(s, one_re, one_im);
      for (std::size_t i = 0; i < 29; ++i) {
        const std::complex<double> g(one_re[i], one_im[i]), expected = bank.response(i);
        ASSERT_NEAR(std::abs(std::complex<double>(re[i], im[i]) - g), 0.0, 1e-12 * std::abs(g))
            << kernel << exponent;
        ASSERT_NEAR(std::abs(expected - g), 0.0, 1e-12 * std::abs(g)) << kernel;
      }
    }
    bank.reset();  // too small for its square to be told from 0
    for (const auto& s : z) bank.step({std::ldexp(s[0], -560), s[1]}, re, im);
    for (std::size_t i = 0; i < 29; ++i) {
      EXPECT_TRUE(re[i] == 0.0 && im[i] == 0.0) << kernel;
      EXPECT_EQ(bank.response(i), std::complex<double>()) << kernel;
    }
  });
}

template <class Real, std::size_t Channels>
std::array<std::vector<Real>, Channels> by_channel(const std::vector<std::array<Real, Channels>>& z) {
  std::array<std::vector<Real>, Channels> out;
  for (const auto& s : z)
    for (std::size_t c = 0; c < Channels; ++c) out[c].push_back(s[c]);
  return out;
}

template <class Real>
void expect_batch(std::size_t lines, std::size_t stride, bool missing, const std::string& kernel) {
  auto bank = make<Real, 32>(lines_hz(lines)), stepped = bank;
  const LineBankBlock<Real, 32> block(bank);
  const std::string where =
      kernel + ", " + std::to_string(lines) + " lines, stride " + std::to_string(stride);
  const auto z = noise<Real, 2>(333, 3, missing);
  const auto signal = by_channel(z);
  const std::size_t apart = missing ? lines + 3 : lines;
  std::vector<Real> re(apart * (333 / stride) + 8, Real(77)), im(re);
  const std::size_t rows = block.run(bank, {signal[0], signal[1]}, stride, re, im, missing ? apart : 0);
  ASSERT_EQ(rows, 333 / stride);
  for (std::size_t k = 0; k < z.size(); ++k) {
    stepped.step(z[k]);
    if ((k + 1) % stride != 0) continue;
    const std::size_t row = ((k + 1) / stride - 1) * apart;
    for (std::size_t i = 0; i < lines; ++i) {
      const std::complex<double> g(stepped.response(i)), found(re[row + i], im[row + i]);
      // The quotient magnifies rounding where little is left of the input.
      const double size = std::max(1e-3, std::abs(std::complex<double>(stepped.phasor(0, i))));
      ASSERT_NEAR(std::abs(g - found), 0.0, 4.0 * kEqual<Real> * (1.0 + std::abs(g)) / size)
          << where << ", sample " << k;
    }
  }
  for (std::size_t i = 0; i < re.size(); ++i)  // nothing but the lines of a row is written
    if (i >= rows * apart || i % apart >= lines) {
      ASSERT_TRUE(re[i] == Real(77) && im[i] == Real(77)) << where;
    }
  for (int more = 0; more < 3; ++more) {  // and it goes on alike
    for (std::size_t c = 0; c < 2; ++c) {
      for (std::size_t i = 0; i < lines; ++i)
        ASSERT_NEAR(std::abs(std::complex<double>(bank.phasor(c, i) - stepped.phasor(c, i))), 0.0,
                    kEqual<Real>)
            << where;
      ASSERT_NEAR(bank.offset(c), stepped.offset(c), kEqual<Real>) << where;
      ASSERT_NEAR(bank.innovation(c), stepped.innovation(c), 10.0 * kEqual<Real>) << where;
    }
    ASSERT_EQ(bank.samples(), stepped.samples());
    ASSERT_EQ(bank.skipped_samples(), stepped.skipped_samples());
    bank.step(Real(0.5), Real(-0.25));
    stepped.step(Real(0.5), Real(-0.25));
  }
}

TEST(LineBankBlock, BatchIsTheSameAsStepping) {
  with_every_kernel([](const std::string& kernel) {
    for (const std::size_t lines : {1U, 7U, 8U, 16U, 21U, 32U}) {
      for (const std::size_t stride : {1U, 3U, 16U, 100U, 400U}) {
        for (const bool missing : {false, true}) {
          ASSERT_NO_FATAL_FAILURE(expect_batch<double>(lines, stride, missing, kernel));
          ASSERT_NO_FATAL_FAILURE(expect_batch<float>(lines, stride, missing, kernel));
        }
      }
    }
  });
}

/// One and three channels, without responses.
template <std::size_t Channels>
void expect_batch_of_channels(const std::string& kernel) {
  auto bank = make<double, 21, Channels>(lines_hz(21)), stepped = bank;
  const auto z = noise<double, Channels>(200, 4, false);
  const auto signal = by_channel(z);
  typename LineBankBlock<double, 21, Channels>::Signals spans;
  for (std::size_t c = 0; c < Channels; ++c) spans[c] = signal[c];
  LineBankBlock<double, 21, Channels>(bank).run(bank, spans);
  for (const auto& s : z) stepped.step(s);
  for (std::size_t c = 0; c < Channels; ++c)
    for (std::size_t i = 0; i < 21; ++i)
      ASSERT_NEAR(std::abs(bank.phasor(c, i) - stepped.phasor(c, i)), 0.0, 1e-12) << kernel;
}
TEST(LineBankBlock, TakesAnyNumberOfChannels) {
  with_every_kernel([](const std::string& kernel) {
    ASSERT_NO_FATAL_FAILURE(expect_batch_of_channels<1>(kernel));
    ASSERT_NO_FATAL_FAILURE(expect_batch_of_channels<3>(kernel));
    ASSERT_NO_FATAL_FAILURE(expect_batch_of_channels<4>(kernel));
  });
}

/// A snapshot is a copy of bytes: it goes on bit for bit with the same kernels, to rounding with others.
TEST(LineBank, SnapshotsGoOnWithAnyKernel) {
  const auto z = noise<double, 2>(400, 8, true);
  auto bank = make<double, 21>(lines_hz(21));
  for (std::size_t k = 0; k < 200; ++k) bank.step(z[k]);
  const auto start = bank;
  for (std::size_t k = 200; k < 400; ++k) bank.step(z[k]);
  auto again = make<double, 21>(lines_hz(3));
  std::memcpy(static_cast<void*>(&again), &start, sizeof start);
  for (std::size_t k = 200; k < 400; ++k) again.step(z[k]);
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): every byte of it is data
  EXPECT_EQ(std::memcmp(&again, &bank, sizeof bank), 0);
  with_every_kernel([&](const std::string& kernel) {
    auto other = start;
    for (std::size_t k = 200; k < 400; ++k) other.step(z[k]);
    for (std::size_t i = 0; i < 21; ++i)
      EXPECT_NEAR(std::abs(other.phasor(1, i) - bank.phasor(1, i)), 0.0, 1e-12) << kernel;
  });
}

}  // namespace
}  // namespace resonid::online
