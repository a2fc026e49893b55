# SPDX-License-Identifier: MIT
# Called by Makefile in the folder of the objects: links them into modules as halcompile does.
obj-m := resonid.o two_mass.o
resonid-objs := resonid_hal.o $(core)
include $(shell halcompile --print-modinc)
EXTRA_CFLAGS += -I$(here)
resonid_hal.o: resonid.c
	$(CC) -o $@ $(EXTRA_CFLAGS) -c $<
.PHONY: where
where:
	@echo $(RTLIBDIR)
