! L5: the C interface of gamboge as it is, with its constants: one interface body a public function
! of the headers include/gamboge, under the C name. The modules above build on it; use it to call C
! just as C does (0-based indices, statuses, text that ends in c_null_char, c_ptr handles).
! An array that may be NULL is a type(c_ptr), value; ptrdiff_t is integer(c_intptr_t).
module gamboge_c
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funptr, c_int, c_int32_t, &
      c_int64_t, c_intptr_t, c_ptr
   use gamboge_c_neighbours
   use gamboge_c_sums
   use gamboge_constants
   implicit none
   public

   interface
      ! status.h

      type(c_ptr) function gbg_status_name(status) bind(c)
         import
         integer(c_int), value :: status
      end function gbg_status_name

      type(c_ptr) function gbg_status_text(status) bind(c)
         import
         integer(c_int), value :: status
      end function gbg_status_text

      ! context.h

      integer(c_int) function gbg_context_create(backend, context) bind(c)
         import
         character(kind=c_char), intent(in) :: backend(*)
         type(c_ptr), intent(inout) :: context
      end function gbg_context_create

      integer(c_int) function gbg_context_destroy(context) bind(c)
         import
         type(c_ptr), intent(inout) :: context
      end function gbg_context_destroy

      type(c_ptr) function gbg_message(context) bind(c)
         import
         type(c_ptr), value :: context
      end function gbg_message

      integer(c_int) function gbg_context_set_log(context, sink, user) bind(c)
         import
         type(c_ptr), value :: context, user
         type(c_funptr), value :: sink
      end function gbg_context_set_log

      integer(c_int) function gbg_context_backend(context, name, instructions, threads) bind(c)
         import
         type(c_ptr), value :: context
         type(c_ptr), intent(out) :: name, instructions
         integer(c_int), intent(out) :: threads
      end function gbg_context_backend

      type(c_ptr) function gbg_version_text() bind(c)
         import
      end function gbg_version_text

      integer(c_int) function gbg_has_component(component) bind(c)
         import
         character(kind=c_char), intent(in) :: component(*)
      end function gbg_has_component

      ! scene.h

      integer(c_int) function gbg_scene_create(context, dimension, scene) bind(c)
         import
         type(c_ptr), value :: context
         integer(c_int), value :: dimension
         type(c_ptr), intent(inout) :: scene
      end function gbg_scene_create

      integer(c_int) function gbg_scene_read(context, path, scene) bind(c)
         import
         type(c_ptr), value :: context
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(inout) :: scene
      end function gbg_scene_read

      integer(c_int) function gbg_scene_destroy(scene) bind(c)
         import
         type(c_ptr), intent(inout) :: scene
      end function gbg_scene_destroy

      integer(c_int) function gbg_scene_set_real(scene, option, value) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: option(*)
         real(c_double), value :: value
      end function gbg_scene_set_real

      integer(c_int) function gbg_scene_set_integer(scene, option, value) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: option(*)
         integer(c_int64_t), value :: value
      end function gbg_scene_set_integer

      integer(c_int) function gbg_scene_set_text(scene, option, value) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: option(*), value(*)
      end function gbg_scene_set_text

      integer(c_int) function gbg_scene_get_real(scene, option, value) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: option(*)
         real(c_double), intent(out) :: value
      end function gbg_scene_get_real

      integer(c_int) function gbg_scene_get_integer(scene, option, value) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: option(*)
         integer(c_int64_t), intent(out) :: value
      end function gbg_scene_get_integer

      integer(c_int) function gbg_scene_get_text(scene, option, capacity, text) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: option(*)
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: text(*)
      end function gbg_scene_get_text

      integer(c_int) function gbg_scene_option(index, line) bind(c)
         import
         integer(c_int), value :: index
         type(c_ptr), intent(out) :: line
      end function gbg_scene_option

      integer(c_int) function gbg_scene_set_box(scene, lengths, origin) bind(c)
         import
         type(c_ptr), value :: scene, origin
         real(c_double), intent(in) :: lengths(*)
      end function gbg_scene_set_box

      integer(c_int) function gbg_scene_get_box(scene, dimension, lengths, origin) bind(c)
         import
         type(c_ptr), value :: scene, origin
         integer(c_int), intent(out) :: dimension
         real(c_double), intent(inout) :: lengths(*)
      end function gbg_scene_get_box

      integer(c_int) function gbg_scene_add_species(scene, name, diameter, alpha, mobility, &
         fraction, count, species) bind(c)
         import
         type(c_ptr), value :: scene
         character(kind=c_char), intent(in) :: name(*)
         real(c_double), value :: diameter, alpha, mobility, fraction
         integer(c_int64_t), value :: count
         integer(c_int), intent(out) :: species
      end function gbg_scene_add_species

      integer(c_int) function gbg_scene_add_force(scene, power, sum, cutoff, tolerance) bind(c)
         import
         type(c_ptr), value :: scene
         real(c_double), value :: power, cutoff, tolerance
         character(kind=c_char), intent(in) :: sum(*)
      end function gbg_scene_add_force

      integer(c_int) function gbg_scene_size(scene, n_species, n_forces) bind(c)
         import
         type(c_ptr), value :: scene
         integer(c_int), intent(out) :: n_species, n_forces
      end function gbg_scene_size

      integer(c_int) function gbg_scene_get_species(scene, species, capacity, name, diameter, &
         alpha, mobility, count) bind(c)
         import
         type(c_ptr), value :: scene
         integer(c_int), value :: species
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: name(*)
         real(c_double), intent(out) :: diameter, alpha, mobility
         integer(c_int64_t), intent(out) :: count
      end function gbg_scene_get_species

      integer(c_int) function gbg_scene_get_force(scene, force, power, sum, cutoff, &
         tolerance) bind(c)
         import
         type(c_ptr), value :: scene
         integer(c_int), value :: force
         real(c_double), intent(out) :: power, cutoff, tolerance
         type(c_ptr), intent(out) :: sum
      end function gbg_scene_get_force

      integer(c_int) function gbg_scene_add_particles(scene, n, x, y, z, step, species, base, &
         ids) bind(c)
         import
         type(c_ptr), value :: scene, x, y, z, species, ids
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step
         integer(c_int), value :: base
      end function gbg_scene_add_particles

      integer(c_int) function gbg_scene_check(scene) bind(c)
         import
         type(c_ptr), value :: scene
      end function gbg_scene_check

      ! engine.h

      integer(c_int) function gbg_engine_create(scene, engine) bind(c)
         import
         type(c_ptr), value :: scene
         type(c_ptr), intent(inout) :: engine
      end function gbg_engine_create

      integer(c_int) function gbg_engine_destroy(engine) bind(c)
         import
         type(c_ptr), intent(inout) :: engine
      end function gbg_engine_destroy

      integer(c_int) function gbg_engine_run(engine, steps) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), value :: steps
      end function gbg_engine_run

      integer(c_int) function gbg_engine_size(engine, n, dimension) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), intent(out) :: n
         integer(c_int), intent(out) :: dimension
      end function gbg_engine_size

      integer(c_int) function gbg_engine_box(engine, lengths, origin) bind(c)
         import
         type(c_ptr), value :: engine, origin
         real(c_double), intent(inout) :: lengths(*)
      end function gbg_engine_box

      integer(c_int) function gbg_engine_positions(engine, wrapped, n, x, y, z, step) bind(c)
         import
         type(c_ptr), value :: engine, x, y, z
         integer(c_int), value :: wrapped
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step
      end function gbg_engine_positions

      integer(c_int) function gbg_engine_set_positions(engine, n, x, y, z, step) bind(c)
         import
         type(c_ptr), value :: engine, x, y, z
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step
      end function gbg_engine_set_positions

      integer(c_int) function gbg_engine_forces(engine, n, x, y, z, step) bind(c)
         import
         type(c_ptr), value :: engine, x, y, z
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step
      end function gbg_engine_forces

      integer(c_int) function gbg_engine_force_error(engine, samples, rms_over_rms, &
         rms_over_median) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), value :: samples
         real(c_double), intent(out) :: rms_over_rms, rms_over_median
      end function gbg_engine_force_error

      integer(c_int) function gbg_engine_species(engine, n, species, base) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), value :: n
         integer(c_int32_t), intent(inout) :: species(*)
         integer(c_int), value :: base
      end function gbg_engine_species

      integer(c_int) function gbg_engine_ids(engine, n, ids) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), value :: n
         integer(c_int64_t), intent(inout) :: ids(*)
      end function gbg_engine_ids

      integer(c_int) function gbg_engine_overlapped(engine, n, flags) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), value :: n
         integer(c_int32_t), intent(inout) :: flags(*)
      end function gbg_engine_overlapped

      integer(c_int) function gbg_engine_integer(engine, name, value) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int64_t), intent(out) :: value
      end function gbg_engine_integer

      integer(c_int) function gbg_engine_real(engine, name, value) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: name(*)
         real(c_double), intent(out) :: value
      end function gbg_engine_real

      integer(c_int) function gbg_engine_plan_size(engine, lines) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int), intent(out) :: lines
      end function gbg_engine_plan_size

      integer(c_int) function gbg_engine_plan_line(engine, line, capacity, text) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int), value :: line
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: text(*)
      end function gbg_engine_plan_line

      integer(c_int) function gbg_engine_save(engine, path) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: path(*)
      end function gbg_engine_save

      integer(c_int) function gbg_engine_load(engine, path) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: path(*)
      end function gbg_engine_load

      integer(c_int) function gbg_engine_hash(engine, capacity, text) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: text(*)
      end function gbg_engine_hash

      ! trajectory.h

      integer(c_int) function gbg_trajectory_create(engine, path, trajectory) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(inout) :: trajectory
      end function gbg_trajectory_create

      integer(c_int) function gbg_trajectory_continue(engine, path, trajectory) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(inout) :: trajectory
      end function gbg_trajectory_continue

      integer(c_int) function gbg_trajectory_append(trajectory, engine) bind(c)
         import
         type(c_ptr), value :: trajectory, engine
      end function gbg_trajectory_append

      integer(c_int) function gbg_trajectory_append_begin(trajectory, engine) bind(c)
         import
         type(c_ptr), value :: trajectory, engine
      end function gbg_trajectory_append_begin

      integer(c_int) function gbg_trajectory_append_end(trajectory) bind(c)
         import
         type(c_ptr), value :: trajectory
      end function gbg_trajectory_append_end

      integer(c_int) function gbg_trajectory_open(context, path, trajectory) bind(c)
         import
         type(c_ptr), value :: context
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), intent(inout) :: trajectory
      end function gbg_trajectory_open

      integer(c_int) function gbg_trajectory_destroy(trajectory) bind(c)
         import
         type(c_ptr), intent(inout) :: trajectory
      end function gbg_trajectory_destroy

      integer(c_int) function gbg_trajectory_size(trajectory, frames, particles, dimension, &
         n_species) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int64_t), intent(out) :: frames, particles
         integer(c_int), intent(out) :: dimension, n_species
      end function gbg_trajectory_size

      integer(c_int) function gbg_trajectory_is_double(trajectory, is_double) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int), intent(out) :: is_double
      end function gbg_trajectory_is_double

      integer(c_int) function gbg_trajectory_is_hard(trajectory, is_hard) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int), intent(out) :: is_hard
      end function gbg_trajectory_is_hard

      integer(c_int) function gbg_trajectory_species(trajectory, n, species, base) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int64_t), value :: n
         integer(c_int32_t), intent(inout) :: species(*)
         integer(c_int), value :: base
      end function gbg_trajectory_species

      integer(c_int) function gbg_trajectory_diameters(trajectory, n, diameters) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int64_t), value :: n
         real(c_double), intent(inout) :: diameters(*)
      end function gbg_trajectory_diameters

      integer(c_int) function gbg_trajectory_species_name(trajectory, species, capacity, name&
         ) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int), value :: species
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: name(*)
      end function gbg_trajectory_species_name

      integer(c_int) function gbg_trajectory_frame(trajectory, frame, time, step, lengths, &
         origin) bind(c)
         import
         type(c_ptr), value :: trajectory, origin
         integer(c_int64_t), value :: frame
         real(c_double), intent(out) :: time
         integer(c_int64_t), intent(out) :: step
         real(c_double), intent(inout) :: lengths(*)
      end function gbg_trajectory_frame

      integer(c_int) function gbg_trajectory_positions(trajectory, frame, n, x, y, z, step&
         ) bind(c)
         import
         type(c_ptr), value :: trajectory, x, y, z
         integer(c_int64_t), value :: frame, n
         integer(c_intptr_t), value :: step
      end function gbg_trajectory_positions

      integer(c_int) function gbg_trajectory_images(trajectory, frame, n, x, y, z, step) bind(c)
         import
         type(c_ptr), value :: trajectory, x, y, z
         integer(c_int64_t), value :: frame, n
         integer(c_intptr_t), value :: step
      end function gbg_trajectory_images

      integer(c_int) function gbg_trajectory_overlapped(trajectory, frame, n, flags) bind(c)
         import
         type(c_ptr), value :: trajectory
         integer(c_int64_t), value :: frame, n
         integer(c_int32_t), intent(inout) :: flags(*)
      end function gbg_trajectory_overlapped

      integer(c_int) function gbg_engine_write_forces(engine, path) bind(c)
         import
         type(c_ptr), value :: engine
         character(kind=c_char), intent(in) :: path(*)
      end function gbg_engine_write_forces

      ! analysis.h

      integer(c_int) function gbg_analysis_create(context, dimension, lengths, n_species, &
         analysis) bind(c)
         import
         type(c_ptr), value :: context
         integer(c_int), value :: dimension, n_species
         real(c_double), intent(in) :: lengths(*)
         type(c_ptr), intent(inout) :: analysis
      end function gbg_analysis_create

      integer(c_int) function gbg_analysis_destroy(analysis) bind(c)
         import
         type(c_ptr), intent(inout) :: analysis
      end function gbg_analysis_destroy

      integer(c_int) function gbg_analysis_set_real(analysis, option, value) bind(c)
         import
         type(c_ptr), value :: analysis
         character(kind=c_char), intent(in) :: option(*)
         real(c_double), value :: value
      end function gbg_analysis_set_real

      integer(c_int) function gbg_analysis_set_text(analysis, option, value) bind(c)
         import
         type(c_ptr), value :: analysis
         character(kind=c_char), intent(in) :: option(*), value(*)
      end function gbg_analysis_set_text

      integer(c_int) function gbg_analysis_add_frame(analysis, n, x, y, z, step, species, base, &
         lengths, storage_error) bind(c)
         import
         type(c_ptr), value :: analysis, x, y, z, species, lengths
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step
         integer(c_int), value :: base
         real(c_double), value :: storage_error
      end function gbg_analysis_add_frame

      integer(c_int) function gbg_analysis_size(analysis, shells, frames) bind(c)
         import
         type(c_ptr), value :: analysis
         integer(c_int64_t), intent(out) :: shells, frames
      end function gbg_analysis_size

      integer(c_int) function gbg_analysis_get(analysis, quantity, capacity, values) bind(c)
         import
         type(c_ptr), value :: analysis
         character(kind=c_char), intent(in) :: quantity(*)
         integer(c_int64_t), value :: capacity
         real(c_double), intent(inout) :: values(*)
      end function gbg_analysis_get

      integer(c_int) function gbg_analysis_get_partial(analysis, a, b, capacity, values, errors&
         ) bind(c)
         import
         type(c_ptr), value :: analysis
         integer(c_int), value :: a, b
         integer(c_int64_t), value :: capacity
         real(c_double), intent(inout) :: values(*), errors(*)
      end function gbg_analysis_get_partial

      integer(c_int) function gbg_analysis_describe(analysis, capacity, text) bind(c)
         import
         type(c_ptr), value :: analysis
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: text(*)
      end function gbg_analysis_describe

      integer(c_int) function gbg_analysis_set_species_name(analysis, species, name) bind(c)
         import
         type(c_ptr), value :: analysis
         integer(c_int), value :: species
         character(kind=c_char), intent(in) :: name(*)
      end function gbg_analysis_set_species_name

      integer(c_int) function gbg_analysis_set_attribute(analysis, name, value) bind(c)
         import
         type(c_ptr), value :: analysis
         character(kind=c_char), intent(in) :: name(*), value(*)
      end function gbg_analysis_set_attribute

      integer(c_int) function gbg_analysis_write(analysis, path) bind(c)
         import
         type(c_ptr), value :: analysis
         character(kind=c_char), intent(in) :: path(*)
      end function gbg_analysis_write

      ! kernels.h

      integer(c_int) function gbg_pair_forces(context, dimension, lengths, power, cutoff, &
         precision, n, x, y, z, step, alpha, mobility, fx, fy, fz, force_step) bind(c)
         import
         type(c_ptr), value :: context, x, y, z, fx, fy, fz
         integer(c_int), value :: dimension
         real(c_double), intent(in) :: lengths(*), alpha(*), mobility(*)
         real(c_double), value :: power, cutoff
         character(kind=c_char), intent(in) :: precision(*)
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step, force_step
      end function gbg_pair_forces

      integer(c_int) function gbg_overlaps_find(context, dimension, lengths, n, x, y, z, step, &
         diameter, tolerance, base, capacity, first, second, count) bind(c)
         import
         type(c_ptr), value :: context, x, y, z
         integer(c_int), value :: dimension, base
         real(c_double), intent(in) :: lengths(*), diameter(*)
         integer(c_int64_t), value :: n, capacity
         integer(c_intptr_t), value :: step
         real(c_double), value :: tolerance
         integer(c_int32_t), intent(inout) :: first(*), second(*)
         integer(c_int64_t), intent(out) :: count
      end function gbg_overlaps_find

      integer(c_int) function gbg_overlaps_remove(context, dimension, lengths, n, x, y, z, &
         step, diameter, rule, max_rounds, rounds) bind(c)
         import
         type(c_ptr), value :: context, x, y, z
         integer(c_int), value :: dimension
         real(c_double), intent(in) :: lengths(*), diameter(*)
         integer(c_int64_t), value :: n, max_rounds
         integer(c_intptr_t), value :: step
         character(kind=c_char), intent(in) :: rule(*)
         integer(c_int64_t), intent(out) :: rounds
      end function gbg_overlaps_remove

      integer(c_int) function gbg_normals(context, seed, run, at_step, first_id, dimension, n, &
         values) bind(c)
         import
         type(c_ptr), value :: context
         integer(c_int64_t), value :: seed, run, at_step, first_id, n
         integer(c_int), value :: dimension
         real(c_double), intent(inout) :: values(*)
      end function gbg_normals
   end interface
end module gamboge_c
