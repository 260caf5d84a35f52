! L5: the structure factor S(k) with its errors, from frames given as arrays x(2,n), x(3,n) or x(n),
! y(n), z(n) of any layout. Species and shells count from 1. Single-precision arguments, or separate
! arrays of different strides, cost a copy.
module gamboge_analysis
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: gbg_analysis_add_frame, gbg_analysis_create, gbg_analysis_describe, &
      gbg_analysis_destroy, gbg_analysis_get, gbg_analysis_get_partial, &
      gbg_analysis_set_attribute, gbg_analysis_set_real, gbg_analysis_set_species_name, &
      gbg_analysis_set_text, gbg_analysis_size, gbg_analysis_write, gbg_e_argument, gbg_e_order, &
      gbg_ok
   use gamboge_context, only: context_of, gbg_context_t
   use gamboge_layout, only: drop, points, take, take_species
   use gamboge_tools, only: buffer_text, c_text, context_handle, context_hold, context_release, &
      context_state, narrow, report, stop_copy, text_capacity
   implicit none
   private

   ! Not to be assigned or returned by a function.
   type, public :: gbg_analysis_t
      private
      type(c_ptr) :: handle = c_null_ptr
      type(context_state), pointer :: context => null()
      integer :: axes = 0
   contains
      generic, public :: create => create64, create32
      procedure, public :: destroy => analysis_destroy
      ! A setting by name, before the first frame: 'k_max', 'tolerance', 'shell_width', 'method',
      ! 'partials'.
      generic, public :: set => set_real64, set_real32, set_text
      generic, public :: add_frame => matrix64, separate64, matrix32, separate32, matrix64_int64, &
         separate64_int64
      generic, public :: get_size => size_int32, size_int64
      procedure, public :: get => analysis_get
      procedure, public :: get_partial => analysis_get_partial
      procedure, public :: describe => analysis_describe
      procedure, public :: set_species_name => analysis_set_species_name
      procedure, public :: set_attribute => analysis_set_attribute
      procedure, public :: write => analysis_write
      procedure, private :: create64, create32, set_real64, set_real32, set_text
      procedure, private :: matrix64, separate64, matrix32, separate32
      procedure, private :: matrix64_int64, separate64_int64, size_int32, size_int64
      procedure, private :: copy => analysis_copy
      generic, public :: assignment(=) => copy
      final :: analysis_finalise
   end type gbg_analysis_t

   character(*), parameter :: adding = 'gbg_analysis_t%add_frame'

contains

   ! A structure factor in a periodic box of size(lengths) dimensions.
   subroutine create64(self, context, lengths, n_species, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      ! box lengths, 2 or 3 of them [length]
      real(real64), intent(in) :: lengths(:)
      ! 1 without it
      integer, intent(in), optional :: n_species
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      integer(c_int) :: species, status
      state => context_of(context)
      if (associated(self%context)) then
         call report(state, gbg_e_order, stat, errmsg, &
                     'gbg_analysis_t%create: this analysis exists already, destroy it first')
         return
      end if
      species = 1
      if (present(n_species)) species = n_species
      status = gbg_analysis_create(context_handle(state), size(lengths), lengths, species, &
                                   self%handle)
      if (status == gbg_ok) then
         call context_hold(state, self%context)
         self%axes = size(lengths)
      end if
      call report(state, status, stat, errmsg)
   end subroutine create64

   subroutine create32(self, context, lengths, n_species, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      integer, intent(in), optional :: n_species
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%create(context, real(lengths, real64), n_species, stat, errmsg)
   end subroutine create32

   ! Twice is allowed.
   subroutine analysis_destroy(self)
      class(gbg_analysis_t), intent(inout) :: self
      integer(c_int) :: status
      status = gbg_analysis_destroy(self%handle)
      call context_release(self%context)
      self%axes = 0
   end subroutine analysis_destroy

   impure elemental subroutine analysis_finalise(self)
      type(gbg_analysis_t), intent(inout) :: self
      call analysis_destroy(self)
   end subroutine analysis_finalise

   ! 'k_max', 'shell_width' [1/length], 'tolerance' (bound of |d rho|/sqrt(n)).
   subroutine set_real64(self, option, value, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      character(*), intent(in) :: option
      real(real64), intent(in) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_analysis_set_real(self%handle, c_text(option), value), stat, &
                  errmsg)
   end subroutine set_real64

   subroutine set_real32(self, option, value, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      character(*), intent(in) :: option
      real(real32), intent(in) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%set(option, real(value, real64), stat, errmsg)
   end subroutine set_real32

   ! 'method' ('auto', 'mesh', 'direct'), 'partials' ('no', 'yes').
   subroutine set_text(self, option, value, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      character(*), intent(in) :: option
      character(*), intent(in) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_analysis_set_text(self%handle, c_text(option), &
                                                      c_text(value)), stat, errmsg)
   end subroutine set_text

   ! Adds a frame. Each species has the same number of particles in all frames.
   subroutine matrix64(self, x, species, lengths, storage_error, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      ! x(2,n) or x(3,n) [length]; in two dimensions a third row is ignored
      real(real64), intent(in), target :: x(:, :)
      ! of each particle, from 1; all the first without it
      integer(int32), intent(in), optional, target :: species(:)
      ! the frame's own box [length], that of create without it
      real(real64), intent(in), optional :: lengths(:)
      ! absolute error of a stored coordinate [length], 0 without it
      real(real64), intent(in), optional :: storage_error
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, adding, self%axes, x)
      call take_species(p, adding, species)
      call add(self, p, lengths, storage_error)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix64

   subroutine separate64(self, x, y, z, species, lengths, storage_error, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      real(real64), intent(in), target :: x(:), y(:)
      ! ignored in two dimensions
      real(real64), intent(in), optional, target :: z(:)
      integer(int32), intent(in), optional, target :: species(:)
      real(real64), intent(in), optional :: lengths(:)
      real(real64), intent(in), optional :: storage_error
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, adding, self%axes, x, y, z)
      call take_species(p, adding, species)
      call add(self, p, lengths, storage_error)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate64

   subroutine matrix32(self, x, species, lengths, storage_error, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      real(real32), intent(in) :: x(:, :)
      integer(int32), intent(in), optional, target :: species(:)
      real(real32), intent(in), optional :: lengths(:)
      real(real32), intent(in), optional :: storage_error
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      real(real64), allocatable :: edges(:), error
      if (present(lengths)) allocate (edges, source=real(lengths, real64))
      if (present(storage_error)) error = storage_error
      call take(p, adding, self%axes, x)
      call take_species(p, adding, species)
      call add(self, p, edges, error)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix32

   subroutine separate32(self, x, y, z, species, lengths, storage_error, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in), optional :: z(:)
      integer(int32), intent(in), optional, target :: species(:)
      real(real32), intent(in), optional :: lengths(:)
      real(real32), intent(in), optional :: storage_error
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      real(real64), allocatable :: edges(:), error
      if (present(lengths)) allocate (edges, source=real(lengths, real64))
      if (present(storage_error)) error = storage_error
      call take(p, adding, self%axes, x, y, z)
      call take_species(p, adding, species)
      call add(self, p, edges, error)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate32

   ! For codes built with -fdefault-integer-8.
   subroutine matrix64_int64(self, x, species, lengths, storage_error, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      real(real64), intent(in), target :: x(:, :)
      integer(int64), intent(in) :: species(:)
      real(real64), intent(in), optional :: lengths(:)
      real(real64), intent(in), optional :: storage_error
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, adding, self%axes, x)
      call take_species(p, adding, species)
      call add(self, p, lengths, storage_error)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix64_int64

   subroutine separate64_int64(self, x, y, z, species, lengths, storage_error, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      real(real64), intent(in), target :: x(:), y(:)
      real(real64), intent(in), optional, target :: z(:)
      integer(int64), intent(in) :: species(:)
      real(real64), intent(in), optional :: lengths(:)
      real(real64), intent(in), optional :: storage_error
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, adding, self%axes, x, y, z)
      call take_species(p, adding, species)
      call add(self, p, lengths, storage_error)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate64_int64

   subroutine add(self, p, lengths, storage_error)
      class(gbg_analysis_t), intent(inout) :: self
      type(points), intent(inout) :: p
      real(real64), intent(in), optional :: lengths(:), storage_error
      real(real64), target :: edges(3)
      real(real64) :: error
      type(c_ptr) :: edges_at
      edges_at = c_null_ptr
      error = 0
      if (present(lengths) .and. p%status == gbg_ok) then
         if (size(lengths) /= self%axes) then
            p%status = gbg_e_argument
            p%problem = adding//': lengths needs one element an axis'
         else
            edges(:self%axes) = lengths
            edges_at = c_loc(edges)
         end if
      end if
      if (present(storage_error)) error = storage_error
      if (p%status == gbg_ok) p%status = &
         gbg_analysis_add_frame(self%handle, p%n, p%x, p%y, p%z, p%step, p%species_at, &
                                1_c_int, edges_at, error)
      call drop(p)
   end subroutine add

   ! Numbers of shells and of frames so far.
   subroutine size_int64(self, shells, frames, stat, errmsg)
      class(gbg_analysis_t), intent(in) :: self
      integer(int64), intent(inout) :: shells
      integer(int64), intent(inout), optional :: frames
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: n_shells, n_frames
      integer(c_int) :: status
      status = gbg_analysis_size(self%handle, n_shells, n_frames)
      if (status == gbg_ok) then
         shells = n_shells
         if (present(frames)) frames = n_frames
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine size_int64

   subroutine size_int32(self, shells, frames, stat, errmsg)
      class(gbg_analysis_t), intent(in) :: self
      integer(int32), intent(inout) :: shells
      integer(int32), intent(inout), optional :: frames
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: n_shells, n_frames
      integer(c_int) :: status
      character(:), allocatable :: problem
      status = gbg_analysis_size(self%handle, n_shells, n_frames)
      call narrow('gbg_analysis_t%get_size', n_shells, shells, status, problem)
      if (status == gbg_ok .and. present(frames)) &
         call narrow('gbg_analysis_t%get_size', n_frames, frames, status, problem)
      call report(self%context, status, stat, errmsg, problem)
   end subroutine size_int32

   ! A quantity of every shell: 'k', 'k_low', 'k_high' [1/length], 'n_modes', 'S', 'S_stderr'
   ! (statistical), 'S_numerr' (hard bound), 'S_numerr_typ', 'S_storage_err'.
   subroutine analysis_get(self, quantity, values, stat, errmsg)
      class(gbg_analysis_t), intent(in) :: self
      character(*), intent(in) :: quantity
      ! receives one element a shell
      real(real64), allocatable, intent(inout) :: values(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), allocatable :: fresh(:)
      integer(c_int) :: status
      call room(self, fresh, status)
      if (status == gbg_ok) status = gbg_analysis_get(self%handle, c_text(quantity), &
                                                      size(fresh, kind=int64), fresh)
      if (status == gbg_ok) call move_alloc(fresh, values)
      call report(self%context, status, stat, errmsg)
   end subroutine analysis_get

   ! Partial structure factor of two species (Ashcroft-Langreth) with its statistical error.
   subroutine analysis_get_partial(self, a, b, values, errors, stat, errmsg)
      class(gbg_analysis_t), intent(in) :: self
      ! species, from 1
      integer, intent(in) :: a, b
      real(real64), allocatable, intent(inout) :: values(:)
      real(real64), allocatable, intent(inout), optional :: errors(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), allocatable :: fresh(:), fresh_errors(:)
      integer(c_int) :: status
      call room(self, fresh, status)
      if (status == gbg_ok) call room(self, fresh_errors, status)
      if (status == gbg_ok) status = gbg_analysis_get_partial(self%handle, a - 1, b - 1, &
                                                              size(fresh, kind=int64), fresh, &
                                                              fresh_errors)
      if (status == gbg_ok) then
         call move_alloc(fresh, values)
         if (present(errors)) call move_alloc(fresh_errors, errors)
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine analysis_get_partial

   ! An array with one element a shell.
   subroutine room(self, values, status)
      class(gbg_analysis_t), intent(in) :: self
      real(real64), allocatable, intent(out) :: values(:)
      integer(c_int), intent(out) :: status
      integer(int64) :: shells, frames
      status = gbg_analysis_size(self%handle, shells, frames)
      if (status == gbg_ok) allocate (values(shells))
   end subroutine room

   ! What was chosen: 'mesh 512x512, ...' or 'direct'.
   subroutine analysis_describe(self, text, stat, errmsg)
      class(gbg_analysis_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: text
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_analysis_describe(self%handle, size(buffer, kind=int64), buffer)
      if (status == gbg_ok) text = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end subroutine analysis_describe

   ! Name of a species in the file.
   subroutine analysis_set_species_name(self, species, name, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      ! from 1
      integer, intent(in) :: species
      character(*), intent(in) :: name
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_analysis_set_species_name(self%handle, species - 1, &
                                                              c_text(name)), stat, errmsg)
   end subroutine analysis_set_species_name

   ! An attribute of the file: 'title', 'input_files', 'input_sha256', 'history'.
   subroutine analysis_set_attribute(self, name, value, stat, errmsg)
      class(gbg_analysis_t), intent(inout) :: self
      character(*), intent(in) :: name, value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_analysis_set_attribute(self%handle, c_text(name), &
                                                           c_text(value)), stat, errmsg)
   end subroutine analysis_set_attribute

   ! Writes a CF netCDF-4 file; one that was there before stays until the new one is complete.
   subroutine analysis_write(self, path, stat, errmsg)
      class(gbg_analysis_t), intent(in) :: self
      character(*), intent(in) :: path
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_analysis_write(self%handle, c_text(path)), stat, errmsg)
   end subroutine analysis_write

   subroutine analysis_copy(self, other)
      class(gbg_analysis_t), intent(inout) :: self
      class(gbg_analysis_t), intent(in) :: other
      if (associated(self%context) .or. associated(other%context)) &
         call stop_copy('gbg_analysis_t')
   end subroutine analysis_copy
end module gamboge_analysis
