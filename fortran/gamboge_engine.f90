! L5: the engine: state, plan and run of a scene. Particles are in the order in which the scene got
! them, species and plan lines count from 1. Arrays x(2,n), x(3,n) or x(n), y(n), z(n) of any layout
! are filled in place; single precision, or separate arrays of different strides, cost a copy.
module gamboge_engine
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int32_t, c_int64_t, c_loc, c_null_ptr, &
      c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: gbg_e_argument, gbg_e_order, gbg_engine_box, gbg_engine_create, &
      gbg_engine_destroy, gbg_engine_force_error, gbg_engine_forces, gbg_engine_get_sum, &
      gbg_engine_hash, gbg_engine_ids, gbg_engine_integer, gbg_engine_load, gbg_engine_overlapped, &
      gbg_engine_plan_line, gbg_engine_plan_size, gbg_engine_positions, gbg_engine_real, &
      gbg_engine_run, gbg_engine_save, gbg_engine_set_positions, gbg_engine_size, &
      gbg_engine_species, gbg_engine_write_forces, gbg_ok
   use gamboge_layout, only: drop, points, put_back, take
   use gamboge_scene, only: gbg_scene_t, scene_context, scene_handle
   use gamboge_tools, only: buffer_text, c_text, context_hold, context_release, context_state, &
      narrow, report, stop_copy, text_capacity
   implicit none
   private

   ! For the modules of the other objects; not part of module gamboge.
   public :: engine_handle, engine_context

   ! Not to be assigned or returned by a function.
   type, public :: gbg_engine_t
      private
      type(c_ptr) :: handle = c_null_ptr
      type(context_state), pointer :: context => null()
      integer :: axes = 0
   contains
      procedure, public :: create => engine_create
      procedure, public :: destroy => engine_destroy
      generic, public :: run => run_int32, run_int64
      generic, public :: get_size => size_int32, size_int64
      procedure, public :: dimension => engine_dimension
      procedure, public :: get_box => engine_get_box
      generic, public :: get_positions => get_matrix64, get_separate64, get_matrix32, &
         get_separate32
      generic, public :: set_positions => set_matrix64, set_separate64, set_matrix32, &
         set_separate32
      generic, public :: get_forces => forces_matrix64, forces_separate64, forces_matrix32, &
         forces_separate32
      procedure, public :: force_error => engine_force_error
      procedure, public :: get_sum => engine_get_sum
      generic, public :: get_species => species_int32, species_int64
      procedure, public :: get_ids => engine_get_ids
      procedure, public :: get_overlapped => engine_get_overlapped
      ! A counter or quantity by name.
      generic, public :: get => get_real64, get_int32, get_int64
      procedure, public :: plan_size => engine_plan_size
      procedure, public :: plan_line => engine_plan_line
      procedure, public :: save => engine_save
      procedure, public :: load => engine_load
      procedure, public :: hash => engine_hash
      procedure, public :: write_forces => engine_write_forces
      procedure, private :: run_int32, run_int64, size_int32, size_int64
      procedure, private :: get_matrix64, get_separate64, get_matrix32, get_separate32
      procedure, private :: set_matrix64, set_separate64, set_matrix32, set_separate32
      procedure, private :: forces_matrix64, forces_separate64, forces_matrix32, forces_separate32
      procedure, private :: species_int32, species_int64, get_real64, get_int32, get_int64
      procedure, private :: copy => engine_copy
      generic, public :: assignment(=) => copy
      final :: engine_finalise
   end type gbg_engine_t

contains

   ! Plans the scene and allocates what running needs; the scene may be changed or destroyed then.
   subroutine engine_create(self, scene, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      type(gbg_scene_t), intent(in) :: scene
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      integer(c_int) :: status
      integer(c_int64_t) :: n
      state => scene_context(scene)
      if (associated(self%context)) then
         call report(state, gbg_e_order, stat, errmsg, &
                     'gbg_engine_t%create: this engine exists already, destroy it first')
         return
      end if
      status = gbg_engine_create(scene_handle(scene), self%handle)
      if (status == gbg_ok) then
         call context_hold(state, self%context)
         status = gbg_engine_size(self%handle, n, self%axes)
      end if
      call report(state, status, stat, errmsg)
   end subroutine engine_create

   ! Twice is allowed.
   subroutine engine_destroy(self)
      class(gbg_engine_t), intent(inout) :: self
      integer(c_int) :: status
      status = gbg_engine_destroy(self%handle)
      call context_release(self%context)
      self%axes = 0
   end subroutine engine_destroy

   impure elemental subroutine engine_finalise(self)
      type(gbg_engine_t), intent(inout) :: self
      call engine_destroy(self)
   end subroutine engine_finalise

   ! Advances by `steps` >= 0 steps. gbg_e_step: the state is that after the last good step.
   subroutine run_int64(self, steps, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      integer(int64), intent(in) :: steps
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_run(self%handle, steps), stat, errmsg)
   end subroutine run_int64

   subroutine run_int32(self, steps, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      integer(int32), intent(in) :: steps
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%run(int(steps, int64), stat, errmsg)
   end subroutine run_int32

   ! Number of particles.
   subroutine size_int64(self, n, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      integer(int64), intent(inout) :: n
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int) :: axes, status
      integer(int64) :: particles
      status = gbg_engine_size(self%handle, particles, axes)
      if (status == gbg_ok) n = particles
      call report(self%context, status, stat, errmsg)
   end subroutine size_int64

   subroutine size_int32(self, n, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      integer(int32), intent(inout) :: n
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int) :: axes, status
      integer(int64) :: particles
      character(:), allocatable :: problem
      status = gbg_engine_size(self%handle, particles, axes)
      call narrow('gbg_engine_t%get_size', particles, n, status, problem)
      call report(self%context, status, stat, errmsg, problem)
   end subroutine size_int32

   ! 2 or 3; 0 before create.
   pure integer function engine_dimension(self)
      class(gbg_engine_t), intent(in) :: self
      engine_dimension = self%axes
   end function engine_dimension

   subroutine engine_get_box(self, lengths, origin, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      ! one an axis [length]
      real(real64), intent(inout) :: lengths(:)
      ! lower corner [length]
      real(real64), intent(inout), optional :: origin(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), target :: edges(3), corner(3)
      integer(c_int) :: status
      logical :: fits
      fits = size(lengths) == self%axes
      if (present(origin)) fits = fits .and. size(origin) == self%axes
      if (.not. fits .and. self%axes > 0) then
         call report(self%context, gbg_e_argument, stat, errmsg, &
                     'gbg_engine_t%get_box: lengths and origin need one element an axis')
         return
      end if
      status = gbg_engine_box(self%handle, edges, c_loc(corner))
      if (status == gbg_ok) then
         lengths = edges(:self%axes)
         if (present(origin)) origin = corner(:self%axes)
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine engine_get_box

   ! Coordinates of all particles.
   subroutine get_matrix64(self, x, wrapped, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      ! x(2,n) or x(3,n) [length]; in two dimensions a third row is left alone
      real(real64), intent(inout), target :: x(:, :)
      ! .true. (the default): inside the box; .false. needs output.trajectory.unwrapped
      logical, intent(in), optional :: wrapped
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_positions', self%axes, x)
      if (p%status == gbg_ok) p%status = gbg_engine_positions(self%handle, wrap_flag(wrapped), &
                                                              p%n, p%x, p%y, p%z, p%step)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine get_matrix64

   subroutine get_separate64(self, x, y, z, wrapped, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      real(real64), intent(inout), target :: x(:), y(:)
      ! left alone in two dimensions
      real(real64), intent(inout), optional, target :: z(:)
      logical, intent(in), optional :: wrapped
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_positions', self%axes, x, y, z)
      if (p%status == gbg_ok) p%status = gbg_engine_positions(self%handle, wrap_flag(wrapped), &
                                                              p%n, p%x, p%y, p%z, p%step)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine get_separate64

   subroutine get_matrix32(self, x, wrapped, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      real(real32), intent(inout) :: x(:, :)
      logical, intent(in), optional :: wrapped
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_positions', self%axes, x)
      if (p%status == gbg_ok) p%status = gbg_engine_positions(self%handle, wrap_flag(wrapped), &
                                                              p%n, p%x, p%y, p%z, p%step)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine get_matrix32

   subroutine get_separate32(self, x, y, z, wrapped, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      real(real32), intent(inout) :: x(:), y(:)
      real(real32), intent(inout), optional :: z(:)
      logical, intent(in), optional :: wrapped
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_positions', self%axes, x, y, z)
      if (p%status == gbg_ok) p%status = gbg_engine_positions(self%handle, wrap_flag(wrapped), &
                                                              p%n, p%x, p%y, p%z, p%step)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine get_separate32

   pure integer(c_int) function wrap_flag(wrapped)
      logical, intent(in), optional :: wrapped
      wrap_flag = 1
      if (present(wrapped)) wrap_flag = merge(1_c_int, 0_c_int, wrapped)
   end function wrap_flag

   ! Replaces all coordinates; refused if hard cores would overlap.
   subroutine set_matrix64(self, x, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      ! x(2,n) or x(3,n) [length]; in two dimensions a third row is ignored
      real(real64), intent(in), target :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%set_positions', self%axes, x)
      if (p%status == gbg_ok) p%status = gbg_engine_set_positions(self%handle, p%n, p%x, p%y, &
                                                                  p%z, p%step)
      call drop(p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_matrix64

   subroutine set_separate64(self, x, y, z, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      real(real64), intent(in), target :: x(:), y(:)
      ! ignored in two dimensions
      real(real64), intent(in), optional, target :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%set_positions', self%axes, x, y, z)
      if (p%status == gbg_ok) p%status = gbg_engine_set_positions(self%handle, p%n, p%x, p%y, &
                                                                  p%z, p%step)
      call drop(p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_separate64

   subroutine set_matrix32(self, x, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      real(real32), intent(in) :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%set_positions', self%axes, x)
      if (p%status == gbg_ok) p%status = gbg_engine_set_positions(self%handle, p%n, p%x, p%y, &
                                                                  p%z, p%step)
      call drop(p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_matrix32

   subroutine set_separate32(self, x, y, z, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in), optional :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%set_positions', self%axes, x, y, z)
      if (p%status == gbg_ok) p%status = gbg_engine_set_positions(self%handle, p%n, p%x, p%y, &
                                                                  p%z, p%step)
      call drop(p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_separate32

   ! Forces on all particles at the present positions [mobility times alpha over length**power].
   subroutine forces_matrix64(self, x, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      ! x(2,n) or x(3,n); in two dimensions a third row is left alone
      real(real64), intent(inout), target :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_forces', self%axes, x)
      if (p%status == gbg_ok) p%status = gbg_engine_forces(self%handle, p%n, p%x, p%y, p%z, &
                                                           p%step)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_matrix64

   subroutine forces_separate64(self, x, y, z, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      real(real64), intent(inout), target :: x(:), y(:)
      ! left alone in two dimensions
      real(real64), intent(inout), optional, target :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_forces', self%axes, x, y, z)
      if (p%status == gbg_ok) p%status = gbg_engine_forces(self%handle, p%n, p%x, p%y, p%z, &
                                                           p%step)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_separate64

   subroutine forces_matrix32(self, x, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      real(real32), intent(inout) :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_forces', self%axes, x)
      if (p%status == gbg_ok) p%status = gbg_engine_forces(self%handle, p%n, p%x, p%y, p%z, &
                                                           p%step)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_matrix32

   subroutine forces_separate32(self, x, y, z, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      real(real32), intent(inout) :: x(:), y(:)
      real(real32), intent(inout), optional :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_engine_t%get_forces', self%axes, x, y, z)
      if (p%status == gbg_ok) p%status = gbg_engine_forces(self%handle, p%n, p%x, p%y, p%z, &
                                                           p%step)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_separate32

   ! Measured error of the forces against a double-precision direct sum.
   subroutine engine_force_error(self, rms_over_rms, rms_over_median, samples, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      ! RMS(dF)/RMS(F) and RMS(dF)/median|F|
      real(real64), intent(inout) :: rms_over_rms, rms_over_median
      ! particles to measure it on, 1000 without it
      integer, intent(in), optional :: samples
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: wanted
      wanted = 0
      if (present(samples)) wanted = samples
      call report(self%context, gbg_engine_force_error(self%handle, wanted, rms_over_rms, &
                                                       rms_over_median), stat, errmsg)
   end subroutine engine_force_error

   ! What is known of a sum over all images: relative RMS error asked for, by the parameter model,
   ! and measured (-1: not yet); how often it was refined to keep to its tolerance.
   subroutine engine_get_sum(self, force, tolerance, predicted, measured, refined, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      ! of the scene, from 1
      integer, intent(in) :: force
      real(real64), intent(inout), optional :: tolerance, predicted, measured
      integer, intent(inout), optional :: refined
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: value(3)
      integer(c_int) :: times, status
      status = gbg_engine_get_sum(self%handle, force - 1, value(1), value(2), value(3), times)
      if (status == gbg_ok) then
         if (present(tolerance)) tolerance = value(1)
         if (present(predicted)) predicted = value(2)
         if (present(measured)) measured = value(3)
         if (present(refined)) refined = times
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine engine_get_sum

   ! Species of all particles, from 1.
   subroutine species_int32(self, species, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      integer(int32), intent(inout), contiguous :: species(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_species(self%handle, size(species, kind=int64), &
                                                   species, 1_c_int), stat, errmsg)
   end subroutine species_int32

   subroutine species_int64(self, species, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      integer(int64), intent(inout) :: species(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int32) :: narrow_species(size(species))
      integer(c_int) :: status
      status = gbg_engine_species(self%handle, size(species, kind=int64), narrow_species, 1_c_int)
      if (status == gbg_ok) species = narrow_species
      call report(self%context, status, stat, errmsg)
   end subroutine species_int64

   ! Permanent ids of all particles.
   subroutine engine_get_ids(self, ids, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      integer(int64), intent(inout), contiguous :: ids(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_ids(self%handle, size(ids, kind=int64), ids), stat, &
                  errmsg)
   end subroutine engine_get_ids

   ! Who took part in an overlap during the last step; needs output.trajectory.overlap.
   subroutine engine_get_overlapped(self, flags, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      logical, intent(inout) :: flags(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int32_t) :: raw(size(flags))
      integer(c_int) :: status
      status = gbg_engine_overlapped(self%handle, size(flags, kind=int64), raw)
      if (status == gbg_ok) flags = raw /= 0
      call report(self%context, status, stat, errmsg)
   end subroutine engine_get_overlapped

   ! 'time', 'dt', 'seconds' (spent in run), 'largest_move' (last step), 'packing',
   ! 'bytes_per_particle'.
   subroutine get_real64(self, name, value, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      character(*), intent(in) :: name
      real(real64), intent(inout) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_real(self%handle, c_text(name), value), stat, errmsg)
   end subroutine get_real64

   ! 'step', 'particles', 'species', 'threads', 'list_builds', 'contact_rounds', 'contact_pairs'.
   subroutine get_int64(self, name, value, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      character(*), intent(in) :: name
      integer(int64), intent(inout) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_integer(self%handle, c_text(name), value), stat, errmsg)
   end subroutine get_int64

   subroutine get_int32(self, name, value, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      character(*), intent(in) :: name
      integer(int32), intent(inout) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: wide
      integer(c_int) :: status
      character(:), allocatable :: problem
      status = gbg_engine_integer(self%handle, c_text(name), wide)
      call narrow('gbg_engine_t%get: '//name, wide, value, status, problem)
      call report(self%context, status, stat, errmsg, problem)
   end subroutine get_int32

   ! Number of lines of the plan.
   subroutine engine_plan_size(self, lines, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      integer, intent(inout) :: lines
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_plan_size(self%handle, lines), stat, errmsg)
   end subroutine engine_plan_size

   ! A line of the plan: 'kernel | what | bytes a particle'.
   subroutine engine_plan_line(self, line, text, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      ! from 1
      integer, intent(in) :: line
      character(:), allocatable, intent(inout) :: text
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_engine_plan_line(self%handle, line - 1, size(buffer, kind=int64), buffer)
      if (status == gbg_ok) text = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end subroutine engine_plan_line

   ! Writes a restart file; the one that was there before is kept as PATH.previous.
   subroutine engine_save(self, path, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      character(*), intent(in) :: path
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_save(self%handle, c_text(path)), stat, errmsg)
   end subroutine engine_save

   ! Continues from a restart file of the same scene, bit for bit.
   subroutine engine_load(self, path, stat, errmsg)
      class(gbg_engine_t), intent(inout) :: self
      character(*), intent(in) :: path
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_load(self%handle, c_text(path)), stat, errmsg)
   end subroutine engine_load

   ! SHA-256 of step, ids and positions as 64 hexadecimal digits: equal for equal states.
   subroutine engine_hash(self, text, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: text
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(kind=c_char) :: buffer(65)
      integer(c_int) :: status
      status = gbg_engine_hash(self%handle, size(buffer, kind=int64), buffer)
      if (status == gbg_ok) text = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end subroutine engine_hash

   ! Writes forces, positions and species of the present state to a netCDF file.
   subroutine engine_write_forces(self, path, stat, errmsg)
      class(gbg_engine_t), intent(in) :: self
      character(*), intent(in) :: path
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_engine_write_forces(self%handle, c_text(path)), stat, errmsg)
   end subroutine engine_write_forces

   subroutine engine_copy(self, other)
      class(gbg_engine_t), intent(inout) :: self
      class(gbg_engine_t), intent(in) :: other
      if (associated(self%context) .or. associated(other%context)) call stop_copy('gbg_engine_t')
   end subroutine engine_copy

   function engine_handle(engine) result(handle)
      type(gbg_engine_t), intent(in) :: engine
      type(c_ptr) :: handle
      handle = engine%handle
   end function engine_handle

   function engine_context(engine) result(context)
      type(gbg_engine_t), intent(in) :: engine
      type(context_state), pointer :: context
      context => engine%context
   end function engine_context
end module gamboge_engine
