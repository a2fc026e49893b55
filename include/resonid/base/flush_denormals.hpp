// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace resonid {

/// While it lives, this thread's floating-point unit takes subnormal numbers for 0, and makes none.
///
/// When an excitation ends, what a filter remembers dies away through the subnormal numbers (below 1.2e-38 in
/// float, 2.2e-308 in double), with which some processors take a hundred times as long. Make one at the
/// beginning of the thread, or of every call where the thread is not yours: two instructions each way.
/// Nothing else changes. x86 (FTZ and DAZ of MXCSR) and ARM (FZ of FPCR or FPSCR); elsewhere it does nothing.
class FlushDenormals {
 public:
  FlushDenormals() noexcept : before_(read()) { write(before_ | kFlush); }
  ~FlushDenormals() { write(before_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
#if defined(__SSE2__)
  using Word = std::uint32_t;
  static constexpr Word kFlush = 0x8040U;
  static Word read() noexcept { return _mm_getcsr(); }
  static void write(Word word) noexcept { _mm_setcsr(word); }
#elif defined(__aarch64__)
  using Word = std::uint64_t;
  static constexpr Word kFlush = Word{1} << 24U;
  static Word read() noexcept {
    Word word;
    asm volatile("mrs %0, fpcr" : "=r"(word));
    return word;
  }
  static void write(Word word) noexcept { asm volatile("msr fpcr, %0" : : "r"(word)); }
#elif defined(__arm__) && defined(__ARM_FP)
  using Word = std::uint32_t;
  static constexpr Word kFlush = Word{1} << 24U;
  static Word read() noexcept {
    Word word;
    asm volatile("vmrs %0, fpscr" : "=r"(word));
    return word;
  }
  static void write(Word word) noexcept { asm volatile("vmsr fpscr, %0" : : "r"(word)); }
#else
  using Word = std::uint32_t;
  static constexpr Word kFlush = 0;
  static Word read() noexcept { return 0; }
  static void write(Word) noexcept {}
#endif
  Word before_;
};

}  // namespace resonid
