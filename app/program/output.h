// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendril::app {

/// Opens each of the standard descriptors that is closed on /dev/null, or the next file or socket that is
/// opened gets its number, and what is printed goes there. To be called before any is opened.
void open_standard_descriptors();

/// Whether a descriptor takes a line now: a write of up to 4096 bytes does not wait for a reader who has
/// stopped reading, as a terminal after Ctrl-S or a pager. Real-time: no (a system call).
bool takes_a_line(int descriptor) noexcept;

/// Whether a descriptor leads to the journal of systemd, which says so to the programs it starts. Real-time:
/// no.
bool is_journal(int descriptor) noexcept;

/// Makes stderr the log of the program, for all threads. The journal gets priorities, and knows time and
/// program by itself. Lines that stderr does not take are dropped and counted, so that neither the robot nor
/// its end waits for a reader.
/// @param program  its name, in each line
void log_to_stderr(const std::string& program);

}  // namespace tendril::app
