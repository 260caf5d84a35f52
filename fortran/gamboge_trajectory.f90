! L5: trajectories in netCDF files, to write and to read. Frames and species count from 1; particles
! are in the order of the file. Arrays x(2,n), x(3,n) or x(n), y(n), z(n) of any layout are filled
! in place; single precision, or separate arrays of different strides, cost a copy.
module gamboge_trajectory
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int32_t, c_intptr_t, c_loc, &
      c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: gbg_e_argument, gbg_e_order, gbg_ok, gbg_trajectory_append, &
      gbg_trajectory_append_begin, gbg_trajectory_append_end, gbg_trajectory_continue, &
      gbg_trajectory_create, gbg_trajectory_destroy, gbg_trajectory_diameters, &
      gbg_trajectory_frame, gbg_trajectory_images, &
      gbg_trajectory_is_double, gbg_trajectory_is_hard, gbg_trajectory_open, &
      gbg_trajectory_overlapped, &
      gbg_trajectory_positions, gbg_trajectory_size, gbg_trajectory_species, &
      gbg_trajectory_species_name
   use gamboge_context, only: context_of, gbg_context_t
   use gamboge_engine, only: engine_context, engine_handle, gbg_engine_t
   use gamboge_layout, only: points, put_back, take
   use gamboge_tools, only: buffer_text, c_text, context_handle, context_hold, context_release, &
      context_state, narrow, report, stop_copy, text_capacity
   implicit none
   private

   ! Not to be assigned or returned by a function.
   type, public :: gbg_trajectory_t
      private
      type(c_ptr) :: handle = c_null_ptr
      type(context_state), pointer :: context => null()
      integer :: axes = 0
   contains
      procedure, public :: create => trajectory_create
      procedure, public :: continue => trajectory_continue
      procedure, public :: append => trajectory_append
      procedure, public :: append_begin => trajectory_append_begin
      procedure, public :: append_end => trajectory_append_end
      procedure, public :: open => trajectory_open
      procedure, public :: destroy => trajectory_destroy
      generic, public :: get_size => size_int32, size_int64
      procedure, public :: dimension => trajectory_dimension
      procedure, public :: is_double => trajectory_is_double
      procedure, public :: is_hard => trajectory_is_hard
      generic, public :: get_species => species_int32, species_int64
      procedure, public :: get_diameters => trajectory_get_diameters
      procedure, public :: species_name => trajectory_species_name
      generic, public :: get_frame => frame_int32, frame_int64
      generic, public :: get_positions => matrix64, separate64, matrix32, separate32, &
         matrix64_int64, separate64_int64
      generic, public :: get_images => images_int32, images_int64
      generic, public :: get_overlapped => overlapped_int32, overlapped_int64
      procedure, private :: size_int32, size_int64, species_int32, species_int64
      procedure, private :: frame_int32, frame_int64, images_int32, images_int64
      procedure, private :: matrix64, separate64, matrix32, separate32
      procedure, private :: matrix64_int64, separate64_int64, overlapped_int32, overlapped_int64
      procedure, private :: copy => trajectory_copy
      generic, public :: assignment(=) => copy
      final :: trajectory_finalise
   end type gbg_trajectory_t

contains

   ! Starts a trajectory of this engine; the file appears with the first frame.
   subroutine trajectory_create(self, engine, path, stat, errmsg)
      class(gbg_trajectory_t), intent(inout) :: self
      type(gbg_engine_t), intent(in) :: engine
      character(*), intent(in) :: path
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      integer(c_int) :: status
      state => engine_context(engine)
      if (exists(self, state, 'create', stat, errmsg)) return
      status = gbg_trajectory_create(engine_handle(engine), c_text(path), self%handle)
      call begin(self, state, status)
      call report(state, status, stat, errmsg)
   end subroutine trajectory_create

   ! Goes on with a trajectory after a restart: frames later than the engine's step are cut off.
   subroutine trajectory_continue(self, engine, path, stat, errmsg)
      class(gbg_trajectory_t), intent(inout) :: self
      type(gbg_engine_t), intent(in) :: engine
      character(*), intent(in) :: path
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      integer(c_int) :: status
      state => engine_context(engine)
      if (exists(self, state, 'continue', stat, errmsg)) return
      status = gbg_trajectory_continue(engine_handle(engine), c_text(path), self%handle)
      call begin(self, state, status)
      call report(state, status, stat, errmsg)
   end subroutine trajectory_continue

   ! Opens a trajectory to read: ours, or any AMBER netCDF.
   subroutine trajectory_open(self, context, path, stat, errmsg)
      class(gbg_trajectory_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      character(*), intent(in) :: path
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      integer(c_int) :: status
      state => context_of(context)
      if (exists(self, state, 'open', stat, errmsg)) return
      status = gbg_trajectory_open(context_handle(state), c_text(path), self%handle)
      call begin(self, state, status)
      call report(state, status, stat, errmsg)
   end subroutine trajectory_open

   ! Refuses to make an object that is there already.
   logical function exists(self, state, call_name, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      type(context_state), pointer, intent(in) :: state
      character(*), intent(in) :: call_name
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      exists = associated(self%context)
      if (exists) call report(state, gbg_e_order, stat, errmsg, 'gbg_trajectory_t%'//call_name// &
                              ': this trajectory exists already, destroy it first')
   end function exists

   ! What create, continue and open have in common after C did its part.
   subroutine begin(self, state, status)
      class(gbg_trajectory_t), intent(inout) :: self
      type(context_state), pointer, intent(in) :: state
      integer(c_int), intent(inout) :: status
      integer(int64) :: frames, particles
      integer(c_int) :: species
      if (status /= gbg_ok) return
      call context_hold(state, self%context)
      status = gbg_trajectory_size(self%handle, frames, particles, self%axes, species)
   end subroutine begin

   ! Writes the engine's present state as the next frame.
   subroutine trajectory_append(self, engine, stat, errmsg)
      class(gbg_trajectory_t), intent(inout) :: self
      type(gbg_engine_t), intent(in) :: engine
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_trajectory_append(self%handle, engine_handle(engine)), stat, &
                  errmsg)
   end subroutine trajectory_append

   ! The same, but the frame may be written while the engine goes on; a later call says if it failed.
   subroutine trajectory_append_begin(self, engine, stat, errmsg)
      class(gbg_trajectory_t), intent(inout) :: self
      type(gbg_engine_t), intent(in) :: engine
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_trajectory_append_begin(self%handle, engine_handle(engine)), &
                  stat, errmsg)
   end subroutine trajectory_append_begin

   ! Waits until the frames that were begun are on the disc.
   subroutine trajectory_append_end(self, stat, errmsg)
      class(gbg_trajectory_t), intent(inout) :: self
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_trajectory_append_end(self%handle), stat, errmsg)
   end subroutine trajectory_append_end

   ! Closes the file. Twice is allowed. What became of frames that were begun is said by append_end.
   subroutine trajectory_destroy(self)
      class(gbg_trajectory_t), intent(inout) :: self
      integer(c_int) :: status
      status = gbg_trajectory_destroy(self%handle)
      call context_release(self%context)
      self%axes = 0
   end subroutine trajectory_destroy

   impure elemental subroutine trajectory_finalise(self)
      type(gbg_trajectory_t), intent(inout) :: self
      call trajectory_destroy(self)
   end subroutine trajectory_finalise

   ! Numbers of frames, of particles in a frame, of species.
   subroutine size_int64(self, frames, particles, n_species, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int64), intent(inout) :: frames, particles
      integer, intent(inout), optional :: n_species
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int) :: axes, species, status
      status = gbg_trajectory_size(self%handle, frames, particles, axes, species)
      if (status == gbg_ok .and. present(n_species)) n_species = species
      call report(self%context, status, stat, errmsg)
   end subroutine size_int64

   subroutine size_int32(self, frames, particles, n_species, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(inout) :: frames, particles
      integer, intent(inout), optional :: n_species
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: many_frames, many
      integer(c_int) :: axes, species, status
      character(:), allocatable :: problem
      status = gbg_trajectory_size(self%handle, many_frames, many, axes, species)
      call narrow('gbg_trajectory_t%get_size', many_frames, frames, status, problem)
      if (status == gbg_ok) call narrow('gbg_trajectory_t%get_size', many, particles, status, &
                                        problem)
      if (status == gbg_ok .and. present(n_species)) n_species = species
      call report(self%context, status, stat, errmsg, problem)
   end subroutine size_int32

   ! 2 or 3; 0 before create, continue or open.
   pure integer function trajectory_dimension(self)
      class(gbg_trajectory_t), intent(in) :: self
      trajectory_dimension = self%axes
   end function trajectory_dimension

   ! Are coordinates stored in double precision?
   subroutine trajectory_is_double(self, is_double, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      logical, intent(inout) :: is_double
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int) :: flag, status
      status = gbg_trajectory_is_double(self%handle, flag)
      if (status == gbg_ok) is_double = flag /= 0
      call report(self%context, status, stat, errmsg)
   end subroutine trajectory_is_double

   ! False if the file says that its particles have no hard cores.
   subroutine trajectory_is_hard(self, is_hard, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      logical, intent(inout) :: is_hard
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int) :: flag, status
      status = gbg_trajectory_is_hard(self%handle, flag)
      if (status == gbg_ok) is_hard = flag /= 0
      call report(self%context, status, stat, errmsg)
   end subroutine trajectory_is_hard

   ! Species of all particles, from 1.
   subroutine species_int32(self, species, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(inout), contiguous :: species(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_trajectory_species(self%handle, size(species, kind=int64), &
                                                       species, 1_c_int), stat, errmsg)
   end subroutine species_int32

   subroutine species_int64(self, species, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int64), intent(inout) :: species(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int32) :: raw(size(species))
      integer(c_int) :: status
      status = gbg_trajectory_species(self%handle, size(species, kind=int64), raw, 1_c_int)
      if (status == gbg_ok) species = raw
      call report(self%context, status, stat, errmsg)
   end subroutine species_int64

   ! Diameters of all particles [length].
   subroutine trajectory_get_diameters(self, diameters, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      real(real64), intent(inout), contiguous :: diameters(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_trajectory_diameters(self%handle, &
                                                         size(diameters, kind=int64), diameters), &
                  stat, errmsg)
   end subroutine trajectory_get_diameters

   ! Name of a species; 'A', 'B', ... if the file has none.
   subroutine trajectory_species_name(self, species, name, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      ! from 1
      integer, intent(in) :: species
      character(:), allocatable, intent(inout) :: name
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_trajectory_species_name(self%handle, species - 1, size(buffer, kind=int64), &
                                           buffer)
      if (status == gbg_ok) name = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end subroutine trajectory_species_name

   ! Time, step number and box of a frame.
   subroutine frame_int64(self, frame, time, step, lengths, origin, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      ! from 1
      integer(int64), intent(in) :: frame
      real(real64), intent(inout), optional :: time
      integer(int64), intent(inout), optional :: step
      ! one an axis [length]
      real(real64), intent(inout), optional :: lengths(:), origin(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), target :: edges(3), corner(3)
      real(real64) :: at_time
      integer(int64) :: at_step
      integer(c_int) :: status
      logical :: fits
      fits = .true.
      if (present(lengths)) fits = size(lengths) == self%axes
      if (present(origin)) fits = fits .and. size(origin) == self%axes
      if (.not. fits .and. self%axes > 0) then
         call report(self%context, gbg_e_argument, stat, errmsg, &
                     'gbg_trajectory_t%get_frame: lengths and origin need one element an axis')
         return
      end if
      status = gbg_trajectory_frame(self%handle, frame - 1, at_time, at_step, edges, c_loc(corner))
      if (status == gbg_ok) then
         if (present(time)) time = at_time
         if (present(step)) step = at_step
         if (present(lengths)) lengths = edges(:self%axes)
         if (present(origin)) origin = corner(:self%axes)
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine frame_int64

   subroutine frame_int32(self, frame, time, step, lengths, origin, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(in) :: frame
      real(real64), intent(inout), optional :: time
      integer(int64), intent(inout), optional :: step
      real(real64), intent(inout), optional :: lengths(:), origin(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%get_frame(int(frame, int64), time, step, lengths, origin, stat, errmsg)
   end subroutine frame_int32

   ! Coordinates of a frame.
   subroutine matrix64(self, frame, x, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      ! from 1
      integer(int32), intent(in) :: frame
      ! x(2,n) or x(3,n) [length]; in two dimensions a third row is left alone
      real(real64), intent(inout), target :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_trajectory_t%get_positions', self%axes, x)
      call read_points(self, int(frame, int64), p)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix64

   subroutine separate64(self, frame, x, y, z, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(in) :: frame
      real(real64), intent(inout), target :: x(:), y(:)
      ! left alone in two dimensions
      real(real64), intent(inout), optional, target :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_trajectory_t%get_positions', self%axes, x, y, z)
      call read_points(self, int(frame, int64), p)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate64

   subroutine matrix32(self, frame, x, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(in) :: frame
      real(real32), intent(inout) :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_trajectory_t%get_positions', self%axes, x)
      call read_points(self, int(frame, int64), p)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix32

   subroutine separate32(self, frame, x, y, z, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(in) :: frame
      real(real32), intent(inout) :: x(:), y(:)
      real(real32), intent(inout), optional :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_trajectory_t%get_positions', self%axes, x, y, z)
      call read_points(self, int(frame, int64), p)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate32

   subroutine matrix64_int64(self, frame, x, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int64), intent(in) :: frame
      real(real64), intent(inout), target :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_trajectory_t%get_positions', self%axes, x)
      call read_points(self, frame, p)
      call put_back(p, x)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix64_int64

   subroutine separate64_int64(self, frame, x, y, z, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int64), intent(in) :: frame
      real(real64), intent(inout), target :: x(:), y(:)
      real(real64), intent(inout), optional, target :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_trajectory_t%get_positions', self%axes, x, y, z)
      call read_points(self, frame, p)
      call put_back(p, x, y, z)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate64_int64

   subroutine read_points(self, frame, p)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int64), intent(in) :: frame
      type(points), intent(inout) :: p
      if (p%status /= gbg_ok) return
      p%status = gbg_trajectory_positions(self%handle, frame - 1, p%n, p%x, p%y, p%z, p%step)
   end subroutine read_points

   ! Image counts of a frame: unwrapped = wrapped + image*length. gbg_e_name if the file has none.
   subroutine images_int64(self, frame, images, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      ! from 1
      integer(int64), intent(in) :: frame
      ! images(2,n) or images(3,n)
      integer(int32), intent(inout) :: images(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int32), target :: raw(size(images, 2) + 1, 3)
      type(c_ptr) :: z
      integer(c_int) :: status
      if (size(images, 1) < self%axes .or. size(images, 1) > 3) then
         call report(self%context, gbg_e_argument, stat, errmsg, &
                     'gbg_trajectory_t%get_images: images needs a row an axis')
         return
      end if
      z = c_null_ptr
      if (self%axes == 3) z = c_loc(raw(1, 3))
      status = gbg_trajectory_images(self%handle, frame - 1, size(images, 2, int64), &
                                     c_loc(raw(1, 1)), c_loc(raw(1, 2)), z, 1_c_intptr_t)
      if (status == gbg_ok) images(:self%axes, :) = transpose(raw(:size(images, 2), :self%axes))
      call report(self%context, status, stat, errmsg)
   end subroutine images_int64

   subroutine images_int32(self, frame, images, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(in) :: frame
      integer(int32), intent(inout) :: images(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%get_images(int(frame, int64), images, stat, errmsg)
   end subroutine images_int32

   ! Who took part in an overlap in the step of this frame; gbg_e_name if the file does not say.
   subroutine overlapped_int64(self, frame, flags, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      ! from 1
      integer(int64), intent(in) :: frame
      logical, intent(inout) :: flags(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int32_t) :: raw(size(flags))
      integer(c_int) :: status
      status = gbg_trajectory_overlapped(self%handle, frame - 1, size(flags, kind=int64), raw)
      if (status == gbg_ok) flags = raw /= 0
      call report(self%context, status, stat, errmsg)
   end subroutine overlapped_int64

   subroutine overlapped_int32(self, frame, flags, stat, errmsg)
      class(gbg_trajectory_t), intent(in) :: self
      integer(int32), intent(in) :: frame
      logical, intent(inout) :: flags(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%get_overlapped(int(frame, int64), flags, stat, errmsg)
   end subroutine overlapped_int32

   subroutine trajectory_copy(self, other)
      class(gbg_trajectory_t), intent(inout) :: self
      class(gbg_trajectory_t), intent(in) :: other
      if (associated(self%context) .or. associated(other%context)) &
         call stop_copy('gbg_trajectory_t')
   end subroutine trajectory_copy
end module gamboge_trajectory
