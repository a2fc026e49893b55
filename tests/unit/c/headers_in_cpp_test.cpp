// SPDX-License-Identifier: MIT
// The C headers serve C++ programs: linkage and noexcept.
#include <resonid/c/resonid.h>

static_assert(noexcept(resonid_version()));
static_assert(noexcept(resonid_rls_step(nullptr, nullptr, 0, 0.0, 1.0)));

int main() {
  RESONID_MEMORY(memory, RESONID_RLS_SIZE);
  resonid_error error = RESONID_ERROR_INIT;
  resonid_rls_settings settings;
  resonid_handle* rls = nullptr;
  if (resonid_defaults(&settings.head, sizeof settings, RESONID_RLS) != RESONID_OK) return 1;
  settings.parameters = 1;
  if (resonid_init(memory, sizeof memory, &settings.head, &rls, &error) != RESONID_OK) return 1;
  const double regressor = 2.0;
  double estimate = 0.0;
  for (int k = 0; k < 1000; ++k)
    if (resonid_rls_step(rls, &regressor, 1, 3.0, 1.0) != RESONID_OK) return 1;
  return resonid_parameters(rls, &estimate, 1) == RESONID_OK && estimate > 1.499 && estimate < 1.501 ? 0 : 1;
}
