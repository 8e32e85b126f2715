// Declares the subcommands of `nif`, each in the file or the folder of its name.
#pragma once

#include "tools/common/options.hpp"

namespace nif::tools {

/// Each adds a subcommand's options to `app`; its callback does the work and throws nif::Error on failure.
void add_attach(Command app);
void add_bake(Command app);
void add_bench(Command app);
void add_devices(Command app);
void add_eval(Command app);
void add_export_shader(Command app);
void add_farm(Command app);
void add_info(Command app);
void add_mesh(Command app);
void add_query(Command app);
void add_render(Command app);
void add_study(Command app);
void add_sweep(Command app);
void add_validate(Command app);

}  // namespace nif::tools
