#pragma once

#include <string>

namespace hydrostat::io {

/// What a process can no longer do.
struct Confinement {
  bool files = false;    // open anything but one clip file and, for glTF and OBJ, what lies beside it, to read
  bool network = false;  // open sockets, start programs, trace or end other processes
};

/// Takes from the running process, for good, what reading `file` does not need, as far as the kernel helps: Landlock for
/// files, seccomp for system calls. Libraries that are loaded later cannot be opened any more. Under a sanitizer nothing is
/// taken.
Confinement confine_to(const std::string& file);

/// Limits the running process: address space [bytes] (not under a sanitizer), processor time [s], no core file, and no byte
/// into any file.
void limit_resources(unsigned long long memory_bytes, unsigned time_s);

/// Lets the running process end as soon as its parent does; at once where the parent, of this process id, has ended before.
void end_with_parent(int parent);

}  // namespace hydrostat::io
