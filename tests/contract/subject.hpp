// SPDX-License-Identifier: MIT
#pragma once

#include <allocation_counter.hpp>
#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

namespace resonid::test {

/// Excitation ru, input u, output y.
using Sample = std::array<double, 3>;
inline constexpr unsigned kRu = 1, kU = 2, kY = 4;

/// Where an estimator's answers go, without heap. `figure` are those that come back to what they were once a
/// disturbance is forgotten, `add` all the others.
class Answers {
 public:
  void figure(double x) noexcept {
    add(x);
    figures_ = count_;
  }
  void figure(std::complex<double> x) noexcept {
    figure(x.real());
    figure(x.imag());
  }
  void add(double x) noexcept {
    if (count_ < value_.size()) value_[count_++] = x;
  }
  template <class Matrix>
  void add_all(const Matrix& m) noexcept {
    for (int i = 0; i < static_cast<int>(m.rows()); ++i)
      for (int j = 0; j < static_cast<int>(m.cols()); ++j) add(static_cast<double>(m(i, j)));
  }
  [[nodiscard]] std::span<const double> all() const noexcept { return {value_.data(), count_}; }
  [[nodiscard]] std::span<const double> figures() const noexcept { return {value_.data(), figures_}; }

 private:
  std::array<double, 192> value_{};
  std::size_t count_ = 0, figures_ = 0;
};

/// An estimator as the suite sees it.
class Subject {
 public:
  virtual ~Subject() = default;
  virtual void step(const Sample& sample) noexcept = 0;
  virtual void reset() noexcept = 0;
  virtual void observe(Answers& answers) const noexcept = 0;
  /// Samples taken for missing so far.
  [[nodiscard]] virtual std::uint64_t skipped() const noexcept = 0;
  /// `count` lost samples in one call; false when there is no such call.
  virtual bool miss(std::uint64_t count) noexcept = 0;
  /// The estimator's own bytes: a snapshot.
  [[nodiscard]] virtual std::span<std::byte> bytes() noexcept = 0;
};

/// What the documentation says of an estimator, and what the suite may expect of it.
struct Case {
  std::string name;        ///< With its number type, as tests are called.
  std::string family;      ///< The same without.
  std::string as_listed;   ///< Template arguments for which the table states the size.
  std::size_t bytes = 0;   ///< Of a snapshot, as listed.
  std::string cost;        ///< What bounds the instructions of a step.
  unsigned arguments = 0;  ///< A sample is missing when one of these is not finite; 0: takes no samples.
  bool single = false;     ///< float
  double recovered =
      0.0;              ///< Figures are back so near, relatively, when missing samples are 3000 samples ago.
  bool forgets = true;  ///< Whether it gets over a spike, or has to be reset.
  double spike = 0.0;   ///< The largest that it gets over, or stays finite with.
  std::unique_ptr<Subject> (*make)() = nullptr;
  std::size_t (*heap_of_create)() = nullptr;  ///< Allocations.
};

/// For messages of failed tests.
inline void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

/// `Traits` tells how to make a `Estimator`, what to give it (`arguments`) and what to ask (`observe`).
template <class Traits>
class Held final : public Subject {
 public:
  using Estimator = decltype(Traits::make());
  static_assert(std::is_trivially_copyable_v<Estimator>);
  static_assert(noexcept(std::declval<Estimator&>().reset()));

  void step(const Sample& sample) noexcept override {
    std::apply(
        [this](const auto&... argument) {
          static_assert(noexcept(estimator_.step(argument...)));
          if constexpr (std::is_void_v<decltype(estimator_.step(argument...))>)
            estimator_.step(argument...);
          else
            returned_ = static_cast<double>(estimator_.step(argument...));
        },
        Traits::arguments(estimator_, sample));
  }
  void reset() noexcept override { estimator_.reset(); }
  void observe(Answers& answers) const noexcept override {
    Traits::observe(estimator_, answers);
    answers.add(returned_);
  }
  [[nodiscard]] std::uint64_t skipped() const noexcept override {
    if constexpr (requires { estimator_.skipped_samples(); }) return estimator_.skipped_samples();
    if constexpr (requires { estimator_.skipped_steps(); }) return estimator_.skipped_steps();
    return 0;
  }
  bool miss(std::uint64_t count) noexcept override {
    if constexpr (requires { estimator_.miss(count); }) {
      static_assert(noexcept(estimator_.miss(count)));
      estimator_.miss(count);
      return true;
    }
    return count == 0;
  }
  [[nodiscard]] std::span<std::byte> bytes() noexcept override {
    return std::as_writable_bytes(std::span(&estimator_, 1));
  }

 private:
  Estimator estimator_ = Traits::make();
  double returned_ = 0.0;
};

template <class Traits>
[[nodiscard]] Case case_of() {
  Case c;
  c.family = Traits::kName;
  c.single = std::is_same_v<typename Traits::Scalar, float>;
  c.name = c.family + (Traits::kTyped ? (c.single ? "Float" : "Double") : "");
  std::erase_if(c.name, [](char x) { return x == ' ' || x == ','; });
  c.as_listed = Traits::kAsListed;
  c.bytes = sizeof(typename Traits::Listed);
  c.cost = Traits::kCost;
  c.arguments = Traits::kArguments;
  c.recovered = Traits::kRecovered;
  if constexpr (requires { Traits::kForgets; }) c.forgets = Traits::kForgets;
  c.spike = c.single ? 1e15 : 1e30;
  if constexpr (requires { Traits::kSpike; }) c.spike = Traits::kSpike;
  c.make = [] { return std::unique_ptr<Subject>(std::make_unique<Held<Traits>>()); };
  c.heap_of_create = [] {
    const std::size_t before = allocations();
    const auto estimator = Traits::make();
    static_cast<void>(estimator);
    return allocations() - before;
  };
  return c;
}

/// All of them, generators first; built once, the order does not change.
const std::vector<Case>& cases();
void add_excitation_cases(std::vector<Case>& all);
void add_tracking_cases(std::vector<Case>& all);
void add_model_cases(std::vector<Case>& all);
void add_other_cases(std::vector<Case>& all);
void add_axis_cases(std::vector<Case>& all);
void add_control_cases(std::vector<Case>& all);

/// Sample k of a fixed record of a drive in its loop, kPeriod samples that repeat: PRBS and two sines at
/// 12 and 31 Hz of 250 Hz sample rate.
inline constexpr std::size_t kPeriod = 4000;
inline constexpr double kRateHz = 250.0;
const Sample& record(std::size_t k) noexcept;

/// FNV-1a over the bits of all answers.
inline std::uint64_t fingerprint(const Subject& subject,
                                 std::uint64_t hash = 14695981039346656037ULL) noexcept {
  Answers answers;
  subject.observe(answers);
  for (const double x : answers.all()) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    for (int i = 0; i < 8; ++i) hash = (hash ^ (bits >> (8 * i) & 0xFFU)) * 1099511628211ULL;
  }
  return hash;
}
/// Steps from sample `from` up to before `to`; the fingerprint of the answers underway and at the end.
inline std::uint64_t run(Subject& subject, std::size_t from, std::size_t to) noexcept {
  std::uint64_t hash = 14695981039346656037ULL;
  for (std::size_t k = from; k < to; ++k) {
    subject.step(record(k));
    if (k % 97 == 0) hash = fingerprint(subject, hash);
  }
  return fingerprint(subject, hash);
}

/// Puts the table that the cases give into docs/realtime.md; returns an exit code.
int write_table();

/// In this process, what the process started by resume_elsewhere() does; returns its exit code.
int resume_from_standard_input();

}  // namespace resonid::test
