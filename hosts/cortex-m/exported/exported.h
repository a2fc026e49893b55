// SPDX-License-Identifier: MIT
// Exported controllers behind one interface: exported.c, which texts.cpp writes, compiles them as C99.
#ifndef RESONID_EXPORTED_H
#define RESONID_EXPORTED_H

#ifdef __cplusplus
extern "C" {
#endif

enum { kToldValues = 5 };

typedef struct exported_controller {
  const char* name;
  void (*init)(void);
  double (*step)(const double* told);  // torque
} exported_controller;

extern const exported_controller exported_controllers[];
extern const int exported_count;
extern const double exported_told[]
                                 [kToldValues];  // [sample], in the order of the arguments of any controller
extern const int exported_samples;

#ifdef __cplusplus
}
#endif
#endif
