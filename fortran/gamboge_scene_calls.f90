! L5: what the calls of a scene do; their interfaces and words are in gamboge_scene.f90.
submodule(gamboge_scene) gamboge_scene_calls
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_loc
   use gamboge_c, only: c_scene_option => gbg_scene_option, gbg_e_argument, gbg_e_order, &
      gbg_ok, gbg_scene_add_force, gbg_scene_add_particles, gbg_scene_add_species, &
      gbg_scene_check, gbg_scene_create, gbg_scene_destroy, gbg_scene_get_box, &
      gbg_scene_get_force, gbg_scene_get_integer, gbg_scene_get_real, gbg_scene_get_species, &
      gbg_scene_get_text, gbg_scene_read, gbg_scene_set_box, gbg_scene_set_force, &
      gbg_scene_set_integer, gbg_scene_set_real, gbg_scene_set_text, gbg_scene_size
   use gamboge_context, only: context_of
   use gamboge_layout, only: drop, points, take, take_ids, take_species
   use gamboge_tools, only: buffer_text, c_text, context_handle, context_hold, context_release, &
      f_text, narrow, report, stop_copy, text_capacity
   implicit none

   character(*), parameter :: adding = 'gbg_scene_t%add_particles'

contains

   module procedure create_int32
      type(context_state), pointer :: state
      integer(c_int) :: status
      state => context_of(context)
      if (exists(self, state, 'create', stat, errmsg)) return
      status = gbg_scene_create(context_handle(state), int(dimension, c_int), self%handle)
      if (status == gbg_ok) then
         call context_hold(state, self%context)
         self%axes = dimension
      end if
      call report(state, status, stat, errmsg)
   end procedure create_int32

   module procedure create_int64
      call self%create(context, int(max(min(dimension, 99_int64), -1_int64), int32), stat, errmsg)
   end procedure create_int64

   module procedure scene_read
      type(context_state), pointer :: state
      real(real64), target :: lengths(3), origin(3)
      integer(c_int) :: status
      state => context_of(context)
      if (exists(self, state, 'read', stat, errmsg)) return
      status = gbg_scene_read(context_handle(state), c_text(path), self%handle)
      if (status == gbg_ok) then
         call context_hold(state, self%context)
         status = gbg_scene_get_box(self%handle, self%axes, lengths, c_loc(origin))
      end if
      call report(state, status, stat, errmsg)
   end procedure scene_read

   ! Refuses to make an object that is there already.
   logical function exists(self, state, call_name, stat, errmsg)
      class(gbg_scene_t), intent(in) :: self
      type(context_state), pointer, intent(in) :: state
      character(*), intent(in) :: call_name
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      exists = associated(self%context)
      if (exists) call report(state, gbg_e_order, stat, errmsg, 'gbg_scene_t%'//call_name// &
                              ': this scene exists already, destroy it first')
   end function exists

   module procedure scene_destroy
      integer(c_int) :: status
      status = gbg_scene_destroy(self%handle)
      call context_release(self%context)
      self%axes = 0
   end procedure scene_destroy

   module procedure scene_finalise
      call scene_destroy(self)
   end procedure scene_finalise

   module procedure set_real64
      call report(self%context, gbg_scene_set_real(self%handle, c_text(option), value), stat, &
                  errmsg)
   end procedure set_real64

   module procedure set_real32
      call self%set(option, real(value, real64), stat, errmsg)
   end procedure set_real32

   module procedure set_int64
      call report(self%context, gbg_scene_set_integer(self%handle, c_text(option), value), stat, &
                  errmsg)
   end procedure set_int64

   module procedure set_int32
      call self%set(option, int(value, int64), stat, errmsg)
   end procedure set_int32

   module procedure set_text
      call report(self%context, gbg_scene_set_text(self%handle, c_text(option), c_text(value)), &
                  stat, errmsg)
   end procedure set_text

   module procedure set_logical
      call self%set(option, merge(1, 0, value), stat, errmsg)
   end procedure set_logical

   module procedure get_real64
      call report(self%context, gbg_scene_get_real(self%handle, c_text(option), value), stat, &
                  errmsg)
   end procedure get_real64

   module procedure get_real32
      real(real64) :: value64
      value64 = value
      call self%get(option, value64, stat, errmsg)
      value = real(value64, real32)
   end procedure get_real32

   module procedure get_int64
      call report(self%context, gbg_scene_get_integer(self%handle, c_text(option), value), stat, &
                  errmsg)
   end procedure get_int64

   module procedure get_int32
      integer(int64) :: value64
      character(:), allocatable :: problem
      integer(c_int) :: status
      status = gbg_scene_get_integer(self%handle, c_text(option), value64)
      call narrow('gbg_scene_t%get: '//option, value64, value, status, problem)
      call report(self%context, status, stat, errmsg, problem)
   end procedure get_int32

   module procedure get_text
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_scene_get_text(self%handle, c_text(option), size(buffer, kind=c_int64_t), buffer)
      if (status == gbg_ok) value = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end procedure get_text

   module procedure get_logical
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_scene_get_text(self%handle, c_text(option), size(buffer, kind=c_int64_t), buffer)
      if (status == gbg_ok) value = buffer_text(buffer) == 'true'
      call report(self%context, status, stat, errmsg)
   end procedure get_logical

   module procedure set_box64
      real(real64), target :: corner(3)
      integer :: last
      corner = 0
      last = self%axes
      if (present(origin)) then
         last = size(origin)
         corner(:min(last, 3)) = origin(:min(last, 3))
      end if
      if (wrong_axes(self, 'set_box', [size(lengths), last], stat, errmsg)) return
      call report(self%context, gbg_scene_set_box(self%handle, lengths, c_loc(corner)), stat, &
                  errmsg)
   end procedure set_box64

   module procedure set_box32
      real(real64), allocatable :: origin64(:)
      if (present(origin)) allocate (origin64, source=real(origin, real64))
      call self%set_box(real(lengths, real64), origin64, stat, errmsg)
   end procedure set_box32

   module procedure get_box64
      real(real64), target :: corner(3)
      real(real64) :: edges(3)
      integer(c_int) :: axes, status
      integer :: last
      last = self%axes
      if (present(origin)) last = size(origin)
      if (wrong_axes(self, 'get_box', [size(lengths), last], stat, errmsg)) return
      status = gbg_scene_get_box(self%handle, axes, edges, c_loc(corner))
      if (status == gbg_ok) then
         lengths = edges(:axes)
         if (present(origin)) origin = corner(:axes)
      end if
      call report(self%context, status, stat, errmsg)
   end procedure get_box64

   module procedure get_box32
      real(real64) :: lengths64(size(lengths))
      real(real64), allocatable :: origin64(:)
      lengths64 = lengths
      if (present(origin)) allocate (origin64, source=real(origin, real64))
      call self%get_box(lengths64, origin64, stat, errmsg)
      lengths = real(lengths64, real32)
      if (present(origin)) origin = real(origin64, real32)
   end procedure get_box32

   ! Refuses arrays that do not have one element an axis.
   logical function wrong_axes(self, call_name, sizes, stat, errmsg)
      class(gbg_scene_t), intent(in) :: self
      character(*), intent(in) :: call_name
      integer, intent(in) :: sizes(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      wrong_axes = self%axes > 0 .and. any(sizes /= self%axes)
      if (wrong_axes) call report(self%context, gbg_e_argument, stat, errmsg, 'gbg_scene_t%'// &
                                  call_name//': lengths and origin need one element an axis')
   end function wrong_axes

   module procedure scene_dimension
      scene_dimension = self%axes
   end procedure scene_dimension

   module procedure add_fraction64
      real(real64) :: part
      part = -1
      if (present(fraction)) part = fraction
      call add_any(self, name, [diameter, alpha, mobility, part], -1_int64, species, stat, errmsg)
   end procedure add_fraction64

   module procedure add_count64
      call add_any(self, name, [diameter, alpha, mobility, -1.0_real64], int(count, int64), &
                   species, stat, errmsg)
   end procedure add_count64

   module procedure add_count64_int64
      call add_any(self, name, [diameter, alpha, mobility, -1.0_real64], count, species, stat, &
                   errmsg)
   end procedure add_count64_int64

   module procedure add_fraction32
      real(real32) :: part
      part = -1
      if (present(fraction)) part = fraction
      call add_any(self, name, real([diameter, alpha, mobility, part], real64), -1_int64, species, &
                   stat, errmsg)
   end procedure add_fraction32

   module procedure add_count32
      call add_any(self, name, real([diameter, alpha, mobility, -1.0], real64), int(count, int64), &
                   species, stat, errmsg)
   end procedure add_count32

   subroutine add_any(self, name, values, count, species, stat, errmsg)
      class(gbg_scene_t), intent(inout) :: self
      character(*), intent(in) :: name
      ! diameter, alpha, mobility, fraction
      real(real64), intent(in) :: values(4)
      integer(int64), intent(in) :: count
      integer, intent(out), optional :: species
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int) :: index, status
      status = gbg_scene_add_species(self%handle, c_text(name), values(1), values(2), values(3), &
                                     values(4), count, index)
      if (status == gbg_ok .and. present(species)) species = index + 1
      call report(self%context, status, stat, errmsg)
   end subroutine add_any

   module procedure add_force64
      character(:), allocatable :: kind
      real(real64) :: reach, error
      kind = 'lattice'
      reach = 0
      error = 0
      if (present(sum)) kind = sum
      if (present(cutoff)) reach = cutoff
      if (present(tolerance)) error = tolerance
      call report(self%context, gbg_scene_add_force(self%handle, power, c_text(kind), reach, &
                                                    error), stat, errmsg)
   end procedure add_force64

   module procedure add_force32
      real(real64) :: reach, error
      reach = 0
      error = 0
      if (present(cutoff)) reach = cutoff
      if (present(tolerance)) error = tolerance
      call self%add_force(real(power, real64), sum, reach, error, stat, errmsg)
   end procedure add_force32

   module procedure add_force_int
      call self%add_force(real(power, real64), sum, cutoff, tolerance, stat, errmsg)
   end procedure add_force_int

   module procedure scene_set_force
      call report(self%context, gbg_scene_set_force(self%handle, force - 1, c_text(option), &
                                                    c_text(value)), stat, errmsg)
   end procedure scene_set_force

   module procedure scene_get_size
      integer(c_int) :: species, forces, status
      status = gbg_scene_size(self%handle, species, forces)
      if (status == gbg_ok) then
         if (present(n_species)) n_species = species
         if (present(n_forces)) n_forces = forces
      end if
      call report(self%context, status, stat, errmsg)
   end procedure scene_get_size

   module procedure scene_get_species
      character(kind=c_char) :: buffer(text_capacity)
      real(real64) :: d, a, m
      integer(int64) :: n
      integer(c_int) :: status
      status = gbg_scene_get_species(self%handle, species - 1, size(buffer, kind=c_int64_t), &
                                     buffer, d, a, m, n)
      if (status == gbg_ok) then
         if (present(name)) name = buffer_text(buffer)
         if (present(diameter)) diameter = d
         if (present(alpha)) alpha = a
         if (present(mobility)) mobility = m
         if (present(count)) count = n
      end if
      call report(self%context, status, stat, errmsg)
   end procedure scene_get_species

   module procedure scene_get_force
      type(c_ptr) :: kind
      real(real64) :: p, reach, error
      integer(c_int) :: status
      status = gbg_scene_get_force(self%handle, force - 1, p, kind, reach, error)
      if (status == gbg_ok) then
         if (present(power)) power = p
         if (present(sum)) sum = f_text(kind)
         if (present(cutoff)) cutoff = reach
         if (present(tolerance)) tolerance = error
      end if
      call report(self%context, status, stat, errmsg)
   end procedure scene_get_force

   module procedure add_matrix64
      type(points) :: p
      call take(p, adding, self%axes, x)
      call take_species(p, adding, species)
      call take_ids(p, adding, ids)
      call add_points(self, p, stat, errmsg)
   end procedure add_matrix64

   module procedure add_separate64
      type(points) :: p
      call take(p, adding, self%axes, x, y, z)
      call take_species(p, adding, species)
      call take_ids(p, adding, ids)
      call add_points(self, p, stat, errmsg)
   end procedure add_separate64

   module procedure add_matrix32
      type(points) :: p
      call take(p, adding, self%axes, x)
      call take_species(p, adding, species)
      call take_ids(p, adding, ids)
      call add_points(self, p, stat, errmsg)
   end procedure add_matrix32

   module procedure add_separate32
      type(points) :: p
      call take(p, adding, self%axes, x, y, z)
      call take_species(p, adding, species)
      call take_ids(p, adding, ids)
      call add_points(self, p, stat, errmsg)
   end procedure add_separate32

   module procedure add_matrix64_int64
      type(points) :: p
      call take(p, adding, self%axes, x)
      call take_species(p, adding, species)
      call take_ids(p, adding, ids)
      call add_points(self, p, stat, errmsg)
   end procedure add_matrix64_int64

   module procedure add_separate64_int64
      type(points) :: p
      call take(p, adding, self%axes, x, y, z)
      call take_species(p, adding, species)
      call take_ids(p, adding, ids)
      call add_points(self, p, stat, errmsg)
   end procedure add_separate64_int64

   subroutine add_points(self, p, stat, errmsg)
      class(gbg_scene_t), intent(inout) :: self
      type(points), intent(inout) :: p
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      if (p%status == gbg_ok) p%status = &
         gbg_scene_add_particles(self%handle, p%n, p%x, p%y, p%z, p%step, p%species_at, 1_c_int, &
                                 p%ids_at)
      call drop(p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine add_points

   module procedure scene_check
      call report(self%context, gbg_scene_check(self%handle), stat, errmsg)
   end procedure scene_check

   module procedure option_line
      type(context_state), pointer :: none
      type(c_ptr) :: text
      integer(c_int) :: status
      none => null()
      status = c_scene_option(index - 1, text)
      if (status == gbg_ok) line = f_text(text)
      call report(none, status, stat, errmsg)
   end procedure option_line

   module procedure scene_copy
      if (associated(self%context) .or. associated(other%context)) call stop_copy('gbg_scene_t')
   end procedure scene_copy

   module procedure scene_handle
      handle = scene%handle
   end procedure scene_handle

   module procedure scene_context
      context => scene%context
   end procedure scene_context

end submodule gamboge_scene_calls
